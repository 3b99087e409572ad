// Estimates the path of a handle between the quantization steps of its encoders.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Smoothest path that is consistent with the reported poses. Work must not be computed along the jumps of the reported
/// pose. Otherwise, a spring of stiffness k whose end is reported in steps δ would seem to give k δ²/2 at each step,
/// whatever the true path.
///
/// Model   p̂_k = q_k + e, with the report q, the estimated velocity v and the period T. Each component of e = p̂_{k−1}
///         + v T − q_k is clamped to half a step, because the true position lies in this interval. If a report
///         alternates between two neighbouring values, the path is at rest. With a wider interval, the path could lag
///         behind like the velocity estimate, and the lag would appear as work. Rotations are treated in the same way,
///         by rotation vectors. If the steps are 0, the path equals the reports
/// Source  our derivation
/// Thread  haptic: no allocation, no throw
class EncoderPath {
 public:
  /// In      …_step_…  resolution of the reported pose along its axes; 0: exact pose
  EncoderPath(double position_step_m, double rotation_step_rad) noexcept;

  /// Returns the next point of the path.
  /// In      X, V  reported pose and estimated velocity; finite
  Pose follow(const Pose& X, const Twist& V, double period_s) noexcept;
  /// Discards the path; it starts again at the next report.
  void lose_pose() noexcept { has_pose_ = false; }

 private:
  double reach_m_;
  double reach_rad_;
  bool has_pose_ = false;
  Pose X_;
};

}  // namespace tandem::haptics
