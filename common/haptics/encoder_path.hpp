// Where a handle went between the steps of its encoders.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// The smoothest path that the reported poses allow: work along the jumps of a report would be that of the encoder.
/// A spring k whose end is reported in steps δ seems to give k δ²/2 with each step, wherever the hand really went.
///
/// Model   p̂_k = q_k + e, each component of e = p̂_{k−1} + v T − q_k held within half a step, where the true place is; q
///         the report, v the estimated velocity. At rest where a report hops between two neighbours. A wider bound lets
///         the path lag with the estimate, which does work of its own. Rotations alike, by rotation vectors.
///         Steps of 0: the reports themselves
/// Source  ours
/// Thread  haptic: no allocation, no throw
class EncoderPath {
 public:
  /// In      …_step_…  resolution of the reported pose along its axes; 0: exact
  EncoderPath(double position_step_m, double rotation_step_rad) noexcept;

  /// In      X, V  reported pose, estimated velocity; finite
  Pose follow(const Pose& X, const Twist& V, double period_s) noexcept;
  /// The next report is where the path begins anew.
  void lose_pose() noexcept { has_pose_ = false; }

 private:
  double reach_m_;
  double reach_rad_;
  bool has_pose_ = false;
  Pose X_;
};

}  // namespace tandem::haptics
