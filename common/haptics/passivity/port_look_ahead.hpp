// Common functions of the passivity controllers: an estimate of a port's work in the coming period, and the gain with
// which the energy balance suffices for that work.
#pragma once

#include <cmath>

#include "common/base/spatial.hpp"

namespace tandem::haptics {

/// Bounds the work of the coming period at a port, using the port's motion in the last period.
///
/// Model   m = |F| (δ + a T²) + |τ| (δ_θ + α T²) bounds the work for any direction of the next motion. F and τ are the
///         force and torque that are held for the period T. δ and δ_θ are the translation and rotation in the last
///         period. a and α are the largest linear and angular accelerations
/// Limits  If an acceleration exceeds a or α, the work may exceed m in one period, by |F| or |τ| times the additional
///         displacement
/// Thread  haptic or room: no allocation, no throw
class PortLookAhead {
 public:
  /// Largest accelerations of hand and device. The tool is assumed not to exceed them.
  static constexpr double kMaxAcceleration_m_per_s2 = 100;
  static constexpr double kMaxAcceleration_rad_per_s2 = 5000;

  /// Ends a period at the pose `X_W`. The motion in the next period is expected to be the fraction `share` of the
  /// motion in this period. `share` is below 1 if this period was longer than the nominal one.
  void move_to(const Pose& X_W, double share = 1) noexcept;
  /// Reports an unknown pose. The motion up to the next move_to() is ignored.
  void lose_pose() noexcept { has_pose_ = false; }
  bool has_pose() const noexcept { return has_pose_; }
  /// Pose of the last move_to().
  const Pose& pose() const noexcept { return X_W_; }
  /// Length of the last period's motion: translation combined with the displacement of a point at the distance
  /// `lever_m` by rotation [m].
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

/// Returns the gain for the coming period: one that rises towards 1, but at most available_j / needed_j. The gain falls
/// at once. A rise from 0 to 1 takes 50 ms, so that the end of an intervention causes no step of force.
double next_passivity_gain(double gain, double needed_j, double available_j, double period_s) noexcept;

}  // namespace tandem::haptics
