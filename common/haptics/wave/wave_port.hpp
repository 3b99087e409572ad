// The two ends of a wave line: where waves become a force on a hand, and where they become the motion of what pulls the
// tool. Each keeps an energy balance, so that sampling creates no energy either.
#pragma once

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/wave/wave.hpp"
#include "common/haptics/wave/wave_line.hpp"

namespace tandem::haptics {

/// What a port has got and not given away: arriving waves and work done on it, less leaving waves and work that it did.
///
/// Model   E += ½|in|² T − work − ½|out|² T; `out` is scaled down so that E ≥ 0, and where that is not enough nothing
///         leaves until E is positive again. E is kept below a limit, so that energy dissipated is not given back.
class WaveAccount {
 public:
  /// The most of `out` that the balance covers. `work_j`: done by the port on what is beyond it, over the same period.
  Wave settle(const Wave& in, const Wave& out, double work_j, double period_s) noexcept;
  double balance_j() const noexcept { return balance_j_; }

 private:
  static constexpr double kLimit_j = 0.05;
  double balance_j_ = 0;
};

/// The hand's end. Once a tick.
///
/// Model   on the hand √(2b) v − b V: the newest wave from the tool, and the line's own impedance; towards the tool
///         goes u = √(2b) V − v of the period that just ended, with V its mean velocity, scaled by WaveAccount with the
///         work that the displayed wrench did on the hand in it
/// Thread  haptic: no allocation, no throw; output finite for any input
class WaveHandPort {
 public:
  WaveHandPort(const WaveImpedance& impedance, const WavePlayer::Settings& player)
      : impedance_(impedance), player_(player) {}

  void receive(Duration sender_time, const Wave& sum) noexcept { player_.receive(sender_time, sum); }
  /// Where the hand is, is not known for a while: the next tick() starts from where it is then.
  void lose_hand() noexcept;
  /// Wrench on the hand for the coming period.
  Wrench tick(const Pose& X_WH, double period_s) noexcept;
  /// What the hand was really given.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  void reset() noexcept { *this = WaveHandPort(impedance_, player_.settings()); }

  /// To be sent.
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
  Wave in_;  ///< of the period that runs
  Wrench displayed_;
};

/// The tool's end: moves the handle that a coupling pulls the tool to. Once a step, move() before it and
/// settle() after.
///
/// Model   V = (√(2b) u − F + B V_before) / (b + K T + B): the impedance's answer to the wave u against the coupling's
///         wrench F, taken implicitly in the coupling's stiffness K and damping B, so that no coupling is too stiff for
///         the step. Towards the hand goes v = (b V − F') / √(2b) with the new wrench F', scaled by WaveAccount.
///         Drift (what was cut, lost, or scaled): V gets (X_target − X) / τ_d as well, when that takes no more than
///         the balance has.
/// Source  Niemeyer, Slotine 1991 and 2004 as in wave.hpp, wave_line.hpp; implicit step and balance are ours
/// Thread  room: no allocation, no throw; output finite for any input
class WaveToolPort {
 public:
  WaveToolPort(const WaveImpedance& impedance, const WavePlayer::Settings& player)
      : impedance_(impedance), player_(player) {}

  void receive(Duration sender_time, const Wave& sum) noexcept { player_.receive(sender_time, sum); }
  /// Where the handle is at the end of the coming step. `hand` is the newest real handle; the first one is where the
  /// virtual one starts.
  /// In      coupling  stiffness and damping at rest, of what pulls the tool there
  const Pose& move(const Pose& X_WH_hand, const CouplingParameters& coupling, double period_s) noexcept;
  const Twist& velocity() const noexcept { return velocity_; }
  /// `on_tool_W`: of the coupling in that step, about the handle's origin.
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
