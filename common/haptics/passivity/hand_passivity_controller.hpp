// Passivity controller of the hand's port, in the client's haptic tick. The hand may take the energy that it put in
// itself, that the server drew from the world for this user, and that the client's own local model gave; no more,
// whatever the delay and whatever computed the wrench. A safety net: it should seldom act, and reports how much it
// withheld.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/haptics/passivity/energy_report.hpp"
#include "common/haptics/passivity/port_look_ahead.hpp"

namespace tandem::haptics {

/// Time-domain passivity observer and controller of the hand's port.
///
/// Model   energy balance E = −Σ (F_j·(x_{j+1} − x_j) + τ_j·θ_{j,j+1}) + (given by the world − taken by it) + C_local, F, τ
///         as displayed and held, x along the path between encoder steps (EncoderPath); the credit C_local is the
///         highest value that the local model's net output has had so far, at least 0. The wrench is scaled by
///         g = min(1, (E + initial credit) / (n m)), m = F·δ + τ·δ_θ the work that the hand takes if it moves on as it
///         did in the last period; g falls at once and rises slowly. A balance E < 0 is forgiven at kLeakRate_w and bounds
///         g by its size, to 0 at kMinBalance_j.
///         Why it starves no hand: at rest and against the force m ≤ 0, so that a hand that presses gets the force which
///         it pays for; a negative balance is gone in −kMinBalance_j / kLeakRate_w = 1 s.
///         Why it holds: the hand never gets more than the world and the local model gave, beyond what it put in, than
///         the initial credit, what is forgiven, and −kMinBalance_j. A negative balance comes from motion that turned within a period,
///         and from what the world took before its report came.
///         World, wire and local model: each sum only grows, so a lost report delays and does no harm.
/// Source  Hannaford, Ryu, "Time-domain passivity control of haptic interfaces", IEEE T-RA 18(1), 2002; theirs looks
///         back and adds damping, ours looks one period ahead and scales. Two-port energies over a delay: Ryu, Artigas,
///         Preusche, "A passive bilateral control scheme for a teleoperator with time-varying communication delay",
///         Mechatronics 20(7), 2010; they let each port give only what came in at the other, ours also what came in
///         here
/// Limits  Energy that dampers and friction dissipated stays in the balance up to kMaxBalance_j, so a limit cycle after
///         long work is not bounded before that is used up. Limits of PortLookAhead. Poses are those of the encoder.
/// Thread  haptic: no allocation, no throw; output finite for any input
class HandPassivityController {
 public:
  /// Balance that may be missing: 0 would refuse the first touch. A hand that leaves a spring k at speed v is not
  /// affected when this is above k (n (v T + a T²))² / 2: 1000 N/m at 0.2 m/s.
  static constexpr double kInitialCredit_j = 2e-4;
  static constexpr double kMaxBalance_j = 2.0;
  static constexpr double kLeakRate_w = 2e-3;     ///< at which a negative balance is forgiven
  static constexpr double kMinBalance_j = -2e-3;  ///< at which no force is left
  static constexpr double kPeriodsAhead = 2.0;    ///< n: more is softer, and acts sooner
  /// Of the loop. A tick that came late does not make the next one as long, and of the work that the hand took
  /// meanwhile only this much of the time is charged: it could not have been foreseen, and without a force a negative
  /// balance would never recover.
  static constexpr double kPeriod_s = 0.001;

  /// The server's running sums, for every update that came; `elapsed_s` since the one before.
  /// In      has_model  what the hand feels is a model of its own, driven by the hand: the world, which mirrors it, takes
  ///                    the same energy a second time, and more where the model is too light; then only the rise of what
  ///                    the world gave above its highest counts
  void world_reported(double from_world_j, double into_world_j, double elapsed_s, bool has_model = false) noexcept;
  /// The local model's running net output (StageOutput::energy_from_local_j); ignored when not finite. The first one
  /// only sets where to count from.
  void local_model_reported(double net_j) noexcept;
  /// Another local model reports from now on.
  void forget_local_model() noexcept { has_local_ = false; }
  /// What may be displayed until the next tick.
  /// In      X_WH  of the hand, without clutch; on_hand_W  about the handle
  /// Fails   zero for a pose, wrench or period that is not finite; the balance is kept
  Wrench apply(const Pose& X_WH, const Wrench& on_hand_W, double period_s) noexcept;
  /// What was really displayed, when later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  /// Without a valid pose of the hand the motion up to the next apply() is left out.
  void lose_hand() noexcept { port_.lose_pose(); }
  /// Forgets everything but the figures of the whole run: withheld_j(), exchanged_j(), limited_ticks().
  void reset() noexcept;

  double balance_j() const noexcept { return balance_j_; }
  /// Σ over periods of what the scaled-away part of the wrench would have given the hand, ≥ 0.
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
  double world_below_peak_j_ = 0;  ///< the world's net output, below its highest so far
  double local_below_peak_j_ = 0;  ///< likewise of the local model
  double local_net_j_ = 0;
  bool has_local_ = false;
  PortLookAhead port_;
  Wrench displayed_;
  Wrench withheld_;        ///< by the gain, in the period that runs
  Wrench left_out_later_;  ///< likewise, by later stages
  double gain_ = 1;
  double balance_j_ = 0;
  double withheld_j_ = 0;
  double exchanged_j_ = 0;
  std::uint64_t limited_ticks_ = 0;
};

}  // namespace tandem::haptics
