// The two ends of a wave line. The hand's end converts waves to a force on a hand. The tool's end converts them to the
// motion of a virtual handle that pulls the tool. Each end has an energy balance, so that sampling does not create
// energy.
#pragma once

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/wave/wave.hpp"
#include "common/haptics/wave/wave_line.hpp"

namespace tandem::haptics {

/// Energy balance of a port: energy of arriving waves and work done on the port, minus energy of leaving waves and work
/// done by the port.
///
/// Model   E += ½|in|² T − work − ½|out|² T in each period T, with the balance E, the arriving wave `in` and the
///         leaving wave `out`. `out` is scaled down such that E ≥ 0. If E is negative even without `out`, nothing is
///         sent until E is positive again. E has an upper limit, so that energy dissipated earlier is not returned
///         later.
class WaveAccount {
 public:
  /// Returns `out`, scaled down if the balance does not cover its energy. `work_j` is the work that the port does on
  /// the hand or tool in the period.
  Wave settle(const Wave& in, const Wave& out, double work_j, double period_s) noexcept;
  double balance_j() const noexcept { return balance_j_; }

 private:
  static constexpr double kLimit_j = 0.05;
  double balance_j_ = 0;
};

/// The hand's end of the line. tick() is called once a tick.
///
/// Model   Wrench on the hand: √(2b) v − b V, with the newest wave v from the tool, the impedance b of the line, and
///         the hand's mean velocity V in the last period. Wave to the tool: u = √(2b) V − v, with v and V of the last
///         period. WaveAccount scales u according to the work of the displayed wrench on the hand in that period
/// Thread  haptic: no allocation, no throw; output finite for any input
class WaveHandPort {
 public:
  WaveHandPort(const WaveImpedance& impedance, const WavePlayer::Settings& player)
      : impedance_(impedance), player_(player) {}

  void receive(Duration sender_time, const Wave& sum) noexcept { player_.receive(sender_time, sum); }
  /// Reports that the hand's pose is unknown. The motion up to the next valid pose is ignored.
  void lose_hand() noexcept;
  /// Returns the wrench on the hand for the coming period.
  Wrench tick(const Pose& X_WH, double period_s) noexcept;
  /// Sets the wrench that was displayed.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  void reset() noexcept { *this = WaveHandPort(impedance_, player_.settings()); }

  /// Integral of the wave to the tool, to be sent.
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

/// The tool's end of the line: moves the virtual handle to which a coupling pulls the tool. In each step move() is
/// called before the coupling is evaluated and settle() after it.
///
/// Model   Velocity of the virtual handle: V = (√(2b) u − F + B V_before) / (b + K T + B). u is the arriving wave, F
///         the coupling's wrench on the tool, b the impedance of the line, and T the period. K and B are the coupling's
///         stiffness and damping. The step is implicit in K and B, so that it is stable for any stiffness.
///         Wave to the hand: v = (b V − F') / √(2b) with the new wrench F', scaled by WaveAccount.
///         Drift: clipped, lost or scaled waves move the virtual handle away from the real one. To correct this drift,
///         a velocity is added to V: the difference of the two poses divided by kDriftTime_s. This velocity is limited,
///         and scaled down if the balance does not cover its work.
/// Source  Niemeyer, Slotine 1991 and 2004, as in wave.hpp and wave_line.hpp; implicit step and balance are ours
/// Thread  room: no allocation, no throw; output finite for any input
class WaveToolPort {
 public:
  WaveToolPort(const WaveImpedance& impedance, const WavePlayer::Settings& player)
      : impedance_(impedance), player_(player) {}

  void receive(Duration sender_time, const Wave& sum) noexcept { player_.receive(sender_time, sum); }
  /// Returns the virtual handle's pose at the end of the coming step. The virtual handle starts at the first pose
  /// received.
  /// In      X_WH_hand  newest pose of the real handle
  const Pose& move(const Pose& X_WH_hand, const CouplingParameters& coupling, double period_s) noexcept;
  const Twist& velocity() const noexcept { return velocity_; }
  /// Ends the step. `on_tool_W` is the wrench of the coupling in that step, about the handle's origin.
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
