// Common functions of the passivity controllers: an estimate of a port's work in the coming period, and the gain with
// which the energy balance suffices for that work.
#pragma once

#include <cmath>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Bounds the work of the coming period at a port, using the port's motion in the last period.
///
/// Model   m = |F| (δ + a T²) + |τ| (δ_θ + α T²). F, τ are held for the period T; δ and δ_θ are the last period's
///         translation and rotation; a and α are the largest accelerations. The bound is valid for any direction of the
///         next motion
/// Limits  if the acceleration is larger, the work may exceed the bound for one period, by |F| times the additional
///         displacement
/// Thread  haptic or room: no allocation, no throw
class PortLookAhead {
 public:
  /// Largest accelerations of hand and device. The tool is assumed not to exceed them.
  static constexpr double kMaxAcceleration_m_per_s2 = 100;
  static constexpr double kMaxAcceleration_rad_per_s2 = 5000;

  /// Ends a period with the port at `X_W`. The next period is expected to repeat this motion. After a late tick, only
  /// the fraction `share` of the motion is expected.
  void move_to(const Pose& X_W, double share = 1) noexcept;
  /// Reports an unknown pose. The motion up to the next move_to() is ignored.
  void lose_pose() noexcept { has_pose_ = false; }
  bool has_pose() const noexcept { return has_pose_; }
  /// Pose of the last move_to().
  const Pose& pose() const noexcept { return X_W_; }
  /// Translation in the last period combined with the displacement by rotation at the lever arm `lever_m` [m].
  double moved_m(double lever_m) const noexcept { return std::hypot(step_m_, lever_m * turn_rad_); }
  /// Bound of the work in the coming period; not finite if norms overflow.
  double max_work_j(const Wrench& held_W, double period_s) const noexcept;
  /// Work in the coming period if the port repeats its last motion; negative if the port receives energy.
  double expected_work_j(const Wrench& held_W) const noexcept {
    return held_W.f.dot(moved_m_) + held_W.t.dot(turned_rad_);
  }

 private:
  bool has_pose_ = false;
  Pose X_W_;
  Vec3 moved_m_ = Vec3::Zero(), turned_rad_ = Vec3::Zero();
  double step_m_ = 0;
  double turn_rad_ = 0;
};

/// Returns the gain of the coming period, at most available_j / needed_j. The gain falls at once and needs 50 ms to
/// rise from 0 to 1, so that an intervention ends without a step of force.
double next_passivity_gain(double gain, double needed_j, double available_j, double period_s) noexcept;

}  // namespace tandem::haptics
