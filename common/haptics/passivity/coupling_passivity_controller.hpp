// Passivity controller of a coupling whose tool is stepped in the same loop as the hand, as in the lab's hand rig.
// Sampling creates energy: a spring whose force is held over a period returns more energy than it received. A client
// cannot use this controller: its tool is stepped at the server, so the work on the tool is known too late.
#pragma once

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Time-domain passivity observer and controller of the port between hand and tool.
///
/// Model   Energy balance after period k: E_k = −Σ F_j·(x_{j+1} − x_j) − Σ τ_j·θ_{j,j+1} + (energy returned by the tool
///         beyond its earlier input). F_j and τ_j are the force and torque held in period j, x_j is the position, and
///         θ_{j,j+1} the rotation in period j.
///         Let m be the largest energy that the hand can take in the next period (PortLookAhead::max_work_j()). If m
///         exceeds E_k + initial credit, the wrench is scaled down until it does not. Usually m is smaller, and the
///         wrench is unchanged.
///
///         Proof of passivity: in any step the hand takes at most E_k + initial credit. A passive tool returns only
///         energy that it received before. Starting from rest, the hand therefore never receives more than the initial
///         credit.
///
///         The work on the tool is not subtracted from E_k. If it were, a hand whose force is scaled down, and which
///         therefore does less work, would be charged for the full work on the tool. The force would then stay scaled
///         down
///         controller uses past energy and adds damping; ours uses a bound one step ahead and scales the wrench
/// Limits  * Valid only if work_on_tool_j belongs to the same period: no delay and no network between hand and tool.
///         * Energy dissipated by dampers and friction stays in the balance. The total energy created since reset() is
///           bounded. After much earlier work, however, a limit cycle is not prevented until the energy in the balance
///           is used up.
///         * The balance is computed from reported positions, so it cannot include motion below the resolution of an
///           encoder.
///         * The limits of PortLookAhead apply.
/// Thread  haptic: no allocation, no throw; output finite for any input
class CouplingPassivityController {
 public:
  static constexpr double kInitialCredit_j = 8e-6;  ///< without this credit the first contact would have no force

  /// Returns the wrench that may be displayed until the next tick.
  /// In      X_WH  handle at this tick; on_hand_W  about the handle; work_on_tool_j  work of the coupling on the tool
  ///         since the last tick, negative if the tool returned energy
  /// Fails   returns zero for a pose, wrench or period that is not finite; the balance stays valid
  Wrench apply(const Pose& X_WH, const Wrench& on_hand_W, double work_on_tool_j, double period_s) noexcept;
  /// Sets the wrench that was displayed, if later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  void reset() noexcept { *this = CouplingPassivityController(); }

  double balance_j() const { return balance_j_; }
  /// Sum over all ticks of (bound m of the coming work − energy available for it), where m exceeded the available
  /// energy.
  double withheld_j() const { return withheld_j_; }

 private:
  void add_to_balance(double energy_j) noexcept;
  void add_tool_output(double work_on_tool_j) noexcept;

  PortLookAhead port_;
  Wrench displayed_;
  double balance_j_ = 0;
  double stored_by_tool_j_ = 0;
  double withheld_j_ = 0;
};

}  // namespace tandem::haptics
