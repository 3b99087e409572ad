// Passivity controller of the hand's port, in the client's haptic tick. The hand may receive its own
// energy input, the energy that the server drew from the world for this user, and the local model's output. This holds
// for any delay and any source of the wrench. A safety net: it should seldom act, and it reports the withheld energy.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Time-domain passivity observer and controller of the hand's port.
///
/// Model   energy balance E = −Σ (F_j·(x_{j+1} − x_j) + τ_j·θ_{j,j+1}) + (given by the world − taken by it) + C_local.
///         F, τ as displayed and held, x along the path between encoder steps (EncoderPath). The credit C_local is the
///         maximum so far of the local model's net output, at least 0. The wrench is scaled by g = min(1, (E + initial
///         credit) / (n m)). m = F·δ + τ·δ_θ is the work that the hand takes if it moves on as in the last period. g
///         falls at once and rises slowly. A negative balance recovers at kLeakRate_w and bounds g by its size, to 0 at
///         kMinBalance_j.
///         Liveness: at rest and against the force m ≤ 0, so a hand that presses receives the force for which it does
///         work. A negative balance has recovered after at most −kMinBalance_j / kLeakRate_w = 1 s.
///         Passivity: the hand never receives more than the sum of five terms: its own input, the output of the world
///         and the local model, the initial credit, the leaked energy, and −kMinBalance_j. A negative balance comes
///         from motion that turned within a period, and from energy that the world took before its report arrived.
///         World, wire and local model report sums, so a lost report delays the balance and does no other harm.
/// Source  Hannaford, Ryu, "Time-domain passivity control of haptic interfaces", IEEE T-RA 18(1), 2002; theirs uses the
///         past and adds damping, ours predicts one period and scales. Two-port energies over a delay: Ryu, Artigas,
///         Preusche, "A passive bilateral control scheme for a teleoperator with time-varying communication delay",
///         Mechatronics 20(7), 2010; in theirs each port may give only the input of the other, in ours also its own
///         input
/// Limits  Energy dissipated by dampers and friction stays in the balance up to kMaxBalance_j, so a limit cycle after
///         long work is bounded only once that is used up. Limits of PortLookAhead.
/// Thread  haptic: no allocation, no throw; output finite for any input
class HandPassivityController {
 public:
  /// Credit beyond the balance: 0 would refuse the first touch. A hand that leaves a spring k at speed v is not
  /// affected when the credit is above k (n (v T + a T²))² / 2: 1000 N/m at 0.2 m/s.
  static constexpr double kInitialCredit_j = 2e-4;
  static constexpr double kMaxBalance_j = 2.0;
  static constexpr double kLeakRate_w = 2e-3;     ///< recovery rate of a negative balance
  static constexpr double kMinBalance_j = -2e-3;  ///< balance at which the force is zero
  static constexpr double kPeriodsAhead = 2.0;    ///< n: a larger value acts softer and earlier
  /// Period of the loop. A late tick does not make the next one equally long. Of the hand's work in a late period only
  /// this share of the time is charged: it could not be predicted, and without a force a negative balance would never
  /// recover.
  static constexpr double kPeriod_s = 0.001;

  /// Adds the server's running sums, once for every received update; `elapsed_s` since the previous one.
  /// In      has_model  the hand feels a local model that it drives itself. The world, which mirrors the model, takes
  ///         the same energy a second time, and more where the model is too light. Then only the rise of the world's
  ///         net output above its maximum counts
  void world_reported(double from_world_j, double into_world_j, double elapsed_s, bool has_model = false) noexcept;
  /// Adds the local model's running net output (StageOutput::energy_from_local_j); ignored when not finite. The first
  /// report only sets the reference.
  void local_model_reported(double net_j) noexcept;
  /// Prepares for the reports of another local model.
  void forget_local_model() noexcept { has_local_ = false; }
  /// Returns the wrench that may be displayed until the next tick.
  /// In      X_WH  pose of the hand, without clutch; on_hand_W  about the handle
  /// Fails   zero for a pose, wrench or period that is not finite; the balance is kept
  Wrench apply(const Pose& X_WH, const Wrench& on_hand_W, double period_s) noexcept;
  /// Sets the displayed wrench when later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  /// Reports that the hand's pose is invalid; the motion up to the next apply() is left out.
  void lose_hand() noexcept { port_.lose_pose(); }
  /// Resets all but the figures of the whole run: withheld_j(), exchanged_j(), limited_ticks().
  void reset() noexcept;

  double balance_j() const noexcept { return balance_j_; }
  /// Σ over periods of the work that the withheld part of the wrench would have done on the hand, ≥ 0.
  double withheld_j() const noexcept { return withheld_j_; }
  /// Σ |work| of the displayed wrench.
  double exchanged_j() const noexcept { return exchanged_j_; }
  std::uint64_t limited_ticks() const noexcept { return limited_ticks_; }
  std::uint64_t dropped_reports() const noexcept { return world_.dropped(); }
  /// g of the last apply().
  double gain() const noexcept { return gain_; }

 private:
  void end_period(const Pose& X_WH, double period_s) noexcept;
  void add_to_balance(double energy_j) noexcept;

  EnergyReport world_;
  double world_below_peak_j_ = 0;  ///< the world's net output below its maximum so far
  double local_below_peak_j_ = 0;  ///< the same for the local model
  double local_net_j_ = 0;
  bool has_local_ = false;
  PortLookAhead port_;
  Wrench displayed_;
  Wrench withheld_;        ///< part withheld by the gain in the current period
  Wrench left_out_later_;  ///< part removed by later stages
  double gain_ = 1;
  double balance_j_ = 0;
  double withheld_j_ = 0;
  double exchanged_j_ = 0;
  std::uint64_t limited_ticks_ = 0;
};

}  // namespace tandem::haptics
