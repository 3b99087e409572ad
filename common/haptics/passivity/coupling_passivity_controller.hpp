// Passivity controller of a coupling whose tool is stepped in the same loop as the hand, as in the lab's hand rig.
// Sampling creates energy: a spring whose force is held for a period returns more than was put in. The live client
// cannot use this controller: its tool is stepped at the other end of a network, so the work on the tool is known too
// late.
#pragma once

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Time-domain passivity observer and controller of the port between hand and tool.
///
/// Model   energy balance E_k = −Σ F_j·(x_{j+1} − x_j) − Σ τ_j·θ_{j,j+1} + (net output of the tool beyond its earlier
///         input), F, τ as displayed and held. The wrench is scaled down so that E_k + initial credit covers m, the
///         bound of PortLookAhead. While the balance suffices, which is nearly always, nothing is changed.
///         Proof: the hand takes no more than E + initial credit in any step, and a passive tool returns only energy
///         that it received before. From rest the hand thus never receives more than the initial credit.
///         The work on the tool is not subtracted: with the hand's force scaled, the hand would be charged for work
///         that it could not do, and the force would never return.
/// Source  Hannaford, Ryu, "Time-domain passivity control of haptic interfaces", IEEE T-RA 18(1), 2002; theirs uses the
///         past and adds damping, ours uses a bound one step ahead and scales
/// Limits  Valid only where work_on_tool_j belongs to the same period: no delay, no network between hand and tool.
///         Energy dissipated by dampers and friction stays in the balance: the energy created since reset() is bounded,
///         a limit cycle after long work is not. The balance uses the given positions and excludes motion within the
///         steps of an encoder. Limits of PortLookAhead.
/// Thread  haptic: no allocation, no throw; output finite for any input
class CouplingPassivityController {
 public:
  static constexpr double kInitialCredit_j = 8e-6;  ///< without it the first touch would be refused

  /// Returns the wrench that may be displayed until the next tick.
  /// In      X_WH  handle at this tick; on_hand_W  about the handle; work_on_tool_j  work of the coupling on the tool
  ///         since the last tick, negative when the tool returned energy
  /// Fails   zero for a pose, wrench or period that is not finite; the balance is kept
  Wrench apply(const Pose& X_WH, const Wrench& on_hand_W, double work_on_tool_j, double period_s) noexcept;
  /// Sets the displayed wrench when later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  void reset() noexcept { *this = CouplingPassivityController(); }

  double balance_j() const { return balance_j_; }
  /// Sum over ticks of the withheld energy: the bound of the hand's input less the permitted part.
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
