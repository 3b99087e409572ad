// Passivity controller of the hand's port, in the client's haptic tick. The hand may receive the sum of three energies:
// the energy that it supplied, the energy that the server reports as drawn from the world for this user, and the net
// output of the local model. This limit holds for any delay and any source of the wrench. The controller is a safety
// net: it should act rarely, and it reports the withheld energy.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Time-domain passivity observer and controller of the hand's port.
///
/// Model   Energy balance: E = −Σ (F_j·(x_{j+1} − x_j) + τ_j·θ_{j,j+1}) + (output of the world − input of the world) +
///         C_local. F_j and τ_j are the force and torque displayed in period j. x_j and the rotations θ_{j,j+1} follow
///         the path between encoder steps (EncoderPath). C_local is the maximum so far of the local model's net output,
///         at least 0.
///         Gain: the wrench is scaled by g = min(1, (E + initial credit) / (n m)). m = F·δ + τ·δ_θ is the work done on
///         the hand if the hand repeats its last motion, with the translation δ and the rotation δ_θ; n is
///         kPeriodsAhead. g falls at once and rises slowly. A negative E recovers at kLeakRate_w and meanwhile limits
///         g, down to 0 at kMinBalance_j.
///         Liveness: if the hand is at rest or moves against the force, m ≤ 0. A hand that pushes therefore feels the
///         force against which it does work. A negative balance recovers within −kMinBalance_j / kLeakRate_w = 1 s.
///         Passivity: the hand never receives more than the sum of five terms: the energy that it supplied, the output
///         of the world and the local model, the initial credit, the leaked energy, and −kMinBalance_j.
///         E becomes negative in two cases: the motion reverses within a period, or the world took energy whose report
///         arrives only later. Server and local model report running sums, so a lost report only delays the balance
/// Source  Hannaford, Ryu, "Time-domain passivity control of haptic interfaces", IEEE T-RA 18(1), 2002. This controller
///         uses past energy and adds damping; ours predicts one period and scales the wrench. Two-port energies over a
///         delay: Ryu, Artigas, Preusche, "A passive bilateral control scheme for a teleoperator with time-varying
///         communication delay", Mechatronics 20(7), 2010. There a port may output only the energy that the other port
///         received; here a port may also output the energy that it received itself
/// Limits  Energy dissipated by dampers and friction stays in the balance, up to kMaxBalance_j. After much earlier work
///         a limit cycle is therefore limited only when that energy is used up. The limits of PortLookAhead apply.
/// Thread  haptic: no allocation, no throw; output finite for any input
class HandPassivityController {
 public:
  /// Energy that the hand may receive in advance; without it, the first contact would have no force. Example: a hand
  /// leaves a spring of stiffness k at the speed v. Its force is not reduced if the credit exceeds k (n (v T + a T²))²
  /// / 2, with n = kPeriodsAhead, the period T and the largest acceleration a of PortLookAhead. This value suffices for
  /// 1000 N/m at 0.2 m/s.
  static constexpr double kInitialCredit_j = 2e-4;
  static constexpr double kMaxBalance_j = 2.0;
  static constexpr double kLeakRate_w = 2e-3;     ///< recovery rate of a negative balance
  static constexpr double kMinBalance_j = -2e-3;  ///< balance at which the force becomes zero
  static constexpr double kPeriodsAhead = 2.0;    ///< n; a larger value acts earlier and less abruptly
  /// Nominal period of the loop. Two rules apply to a period that was longer:
  /// 1. The next period is assumed to have the nominal length again.
  /// 2. If the hand received energy in the long period, only the fraction kPeriod_s / period of this energy is
  ///    subtracted from the balance. The controller could not predict the long period. Subtracting all of it would
  ///    suppress the force, and the balance could not recover without a force.
  static constexpr double kPeriod_s = 0.001;

  /// Adds the server's running sums, once for each received update; `elapsed_s` is the time since the previous update.
  /// In      has_model  whether the hand drives a local model. In this case the server's world repeats the motion of
  ///         the local model, and takes the energy a second time (more if the model's bodies are too light). The
  ///         balance then receives the world's net output only as far as it rises above its maximum so far
  void world_reported(double from_world_j, double into_world_j, double elapsed_s, bool has_model = false) noexcept;
  /// Adds the local model's running net output (StageOutput::energy_from_local_j). A value that is not finite is
  /// ignored. The first report only sets the reference.
  void local_model_reported(double net_j) noexcept;
  /// Discards the reference after a change of the local model; the next report sets a new one.
  void forget_local_model() noexcept { has_local_ = false; }
  /// Returns the wrench that may be displayed until the next tick.
  /// In      X_WH  pose of the hand, without the displacement by the clutch; on_hand_W  about the handle
  /// Fails   returns zero for a pose, wrench or period that is not finite; the balance stays valid
  Wrench apply(const Pose& X_WH, const Wrench& on_hand_W, double period_s) noexcept;
  /// Sets the wrench that was displayed, if later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  /// Reports that the hand's pose is invalid. Work along the motion up to the next apply() does not change the balance.
  void lose_hand() noexcept { port_.lose_pose(); }
  /// Resets everything except the totals of the run: withheld_j(), exchanged_j(), limited_ticks().
  void reset() noexcept;

  double balance_j() const noexcept { return balance_j_; }
  /// Sum over all periods of the work that the withheld part of the wrench would have done on the hand, ≥ 0.
  double withheld_j() const noexcept { return withheld_j_; }
  /// Sum of |work| of the displayed wrench.
  double exchanged_j() const noexcept { return exchanged_j_; }
  std::uint64_t limited_ticks() const noexcept { return limited_ticks_; }
  std::uint64_t dropped_reports() const noexcept { return world_.dropped(); }
  /// Gain g of the last apply().
  double gain() const noexcept { return gain_; }

 private:
  void end_period(const Pose& X_WH, double period_s) noexcept;
  void add_to_balance(double energy_j) noexcept;

  EnergyReport world_;
  double world_below_peak_j_ = 0;  ///< amount by which the world's net output is below its maximum so far
  double local_below_peak_j_ = 0;  ///< amount by which the local model's net output is below its maximum so far
  double local_net_j_ = 0;
  bool has_local_ = false;
  PortLookAhead port_;
  Wrench displayed_;
  Wrench withheld_;        ///< part of the wrench withheld by the gain in the current period
  Wrench left_out_later_;  ///< part of the wrench removed by later safety stages
  double gain_ = 1;
  double balance_j_ = 0;
  double withheld_j_ = 0;
  double exchanged_j_ = 0;
  std::uint64_t limited_ticks_ = 0;
};

}  // namespace tandem::haptics
