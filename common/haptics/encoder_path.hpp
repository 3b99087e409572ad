// Estimates the path of a handle between the quantization steps of its encoders.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Path of the true pose, estimated between the quantization steps of the encoders. Work must be computed along this
/// path, not along the jumps of the reported pose. Along the jumps, a spring of stiffness k whose end is reported in
/// steps of δ would seem to give k δ²/2 at each step, for any true path.
///
/// Model   Path position at tick k: p̂_k = q_k + e_k, with the reported position q_k and the correction e_k = p̂_{k−1}
///         + v T − q_k. v is the estimated velocity and T the period. Each component of e_k is clamped to half a step,
///         because the true position lies within half a step of the report.
///         At rest, a report that alternates between two neighbouring values gives a constant path. A wider clamp would
///         let the path lag as the velocity estimate does; the lag would appear as work.
///         Rotations are treated in the same way, by rotation vectors. If the steps are 0, the path equals the reports
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
