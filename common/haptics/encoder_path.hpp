// Estimated path of a handle between the steps of its encoders.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Smoothest path that the reported poses allow. Work along the jumps of the report would be an artefact of the
/// encoder: a spring k whose end is reported in steps δ seems to give k δ²/2 with each step, for any path of the hand.
///
/// Model   p̂_k = q_k + e. Each component of e = p̂_{k−1} + v T − q_k is clamped to half a step, the interval of the
///         true place; q the report, v the estimated velocity. The path is at rest where a report alternates between
///         two neighbours. A wider bound would let the path lag with the estimate, which does work of its own.
///         Rotations alike, by rotation vectors. Steps of 0: the reports themselves
/// Source  ours
/// Thread  haptic: no allocation, no throw
class EncoderPath {
 public:
  /// In      …_step_…  resolution of the reported pose along its axes; 0: exact
  EncoderPath(double position_step_m, double rotation_step_rad) noexcept;

  /// In      X, V  reported pose, estimated velocity; finite
  Pose follow(const Pose& X, const Twist& V, double period_s) noexcept;
  /// Restarts the path at the next report.
  void lose_pose() noexcept { has_pose_ = false; }

 private:
  double reach_m_;
  double reach_rad_;
  bool has_pose_ = false;
  Pose X_;
};

}  // namespace tandem::haptics
