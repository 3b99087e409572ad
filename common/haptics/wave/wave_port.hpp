// The two ends of a wave line: one converts waves to a force on a hand, the other to the motion of the handle that
// pulls the tool. Each keeps an energy balance, so that sampling creates no energy either.
#pragma once

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/wave/wave.hpp"
#include "common/haptics/wave/wave_line.hpp"

namespace tandem::haptics {

/// Energy balance of a port: arriving waves and work done on it, less leaving waves and work done by it.
///
/// Model   E += ½|in|² T − work − ½|out|² T. `out` is scaled down so that E ≥ 0; where that is not enough, nothing
///         leaves until E is positive again. E is kept below a limit, so that dissipated energy is not returned.
class WaveAccount {
 public:
  /// Returns the largest multiple of `out`, at most `out`, that the balance covers. `work_j`: work done by the port on
  /// the hand or tool over the same period.
  Wave settle(const Wave& in, const Wave& out, double work_j, double period_s) noexcept;
  double balance_j() const noexcept { return balance_j_; }

 private:
  static constexpr double kLimit_j = 0.05;
  double balance_j_ = 0;
};

/// The hand's end of the line. Called once a tick.
///
/// Model   on the hand √(2b) v − b V: the newest wave from the tool, and the line's own impedance. Towards the tool
///         u = √(2b) V − v of the last period, with V its mean velocity. WaveAccount scales u by the work of the
///         displayed wrench on the hand in that period
/// Thread  haptic: no allocation, no throw; output finite for any input
class WaveHandPort {
 public:
  WaveHandPort(const WaveImpedance& impedance, const WavePlayer::Settings& player)
      : impedance_(impedance), player_(player) {}

  void receive(Duration sender_time, const Wave& sum) noexcept { player_.receive(sender_time, sum); }
  /// Reports that the hand's pose is unknown; the next tick() starts from its pose then.
  void lose_hand() noexcept;
  /// Returns the wrench on the hand for the coming period.
  Wrench tick(const Pose& X_WH, double period_s) noexcept;
  /// Sets the wrench that was displayed.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  void reset() noexcept { *this = WaveHandPort(impedance_, player_.settings()); }

  /// Sum to be sent.
  const Wave& sum_towards_tool() const noexcept { return sum_; }
  double balance_j() const noexcept { return account_.balance_j(); }

 private:
  void end_period(const Pose& X_WH, double period_s) noexcept;

  WaveImpedance impedance_;
  WavePlayer player_;
  Wave sum_;
  WaveAccount account_;
  Pose X_WH_;
  bool has_pose_ = false;
  Twist velocity_;
  Wave in_;  ///< wave of the current period
  Wrench displayed_;
};

/// The tool's end of the line: moves the handle to which a coupling pulls the tool. Called once a step, move() before
/// it and settle() after.
///
/// Model   V = (√(2b) u − F + B V_before) / (b + K T + B): the impedance's answer to the wave u against the coupling's
///         wrench F, implicit in the coupling's stiffness K and damping B, so that no coupling is too stiff for the
///         step. Towards the hand v = (b V − F') / √(2b) with the new wrench F', scaled by WaveAccount.
///         Drift (from clipped, lost or scaled waves): V also gets (X_target − X) / τ_d, as far as the balance covers
///         it.
/// Source  Niemeyer, Slotine 1991 and 2004 as in wave.hpp, wave_line.hpp; implicit step and balance are ours
/// Thread  room: no allocation, no throw; output finite for any input
class WaveToolPort {
 public:
  WaveToolPort(const WaveImpedance& impedance, const WavePlayer::Settings& player)
      : impedance_(impedance), player_(player) {}

  void receive(Duration sender_time, const Wave& sum) noexcept { player_.receive(sender_time, sum); }
  /// Returns the handle's pose at the end of the coming step. `hand` is the newest real handle; the virtual one starts
  /// at the first of them.
  /// In      coupling  stiffness and damping, at rest, of the coupling that pulls the tool
  const Pose& move(const Pose& X_WH_hand, const CouplingParameters& coupling, double period_s) noexcept;
  const Twist& velocity() const noexcept { return velocity_; }
  /// Ends the step. `on_tool_W`: wrench of the coupling in that step, about the handle's origin.
  void settle(const Wrench& on_tool_W, double period_s) noexcept;
  void reset() noexcept { *this = WaveToolPort(impedance_, player_.settings()); }

  const Wave& sum_towards_hand() const noexcept { return sum_; }
  double balance_j() const noexcept { return account_.balance_j(); }

 private:
  Twist answer(const Wave& in, const CouplingParameters& coupling, double period_s) const noexcept;
  Twist drift_correction(const Pose& X_WH_hand, double period_s) const noexcept;

  static constexpr double kDriftTime_s = 0.5;
  static constexpr double kDriftSpeed_m_per_s = 0.05;
  static constexpr double kDriftTurn_rad_per_s = 0.5;

  WaveImpedance impedance_;
  WavePlayer player_;
  Wave sum_;
  WaveAccount account_;
  bool has_pose_ = false;
  Pose X_;
  Pose X_before_;
  Twist velocity_;
  Wave in_;
  Wrench on_tool_W_;
};

}  // namespace tandem::haptics
