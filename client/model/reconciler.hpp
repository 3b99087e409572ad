// Reconciliation at matched time: the server's state answers an input one round trip old. Its difference to the model's
// state at the same input is the model's error, independent of the delay. It is removed without a step.
#pragma once

#include "common/base/spatial.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// A displacement of a rigid body with its rates, all in W: added to its pose and twist.
struct Shift {
  Vec3 p = Vec3::Zero();      ///< [m]
  Vec3 theta = Vec3::Zero();  ///< rotation vector [rad]
  Vec3 v = Vec3::Zero();      ///< [m/s]
  Vec3 w = Vec3::Zero();      ///< [rad/s]

  Shift operator+(const Shift& other) const { return {p + other.p, theta + other.theta, v + other.v, w + other.w}; }
  Shift operator-(const Shift& other) const { return {p - other.p, theta - other.theta, v - other.v, w - other.w}; }
  Shift operator*(double scale) const { return {p * scale, theta * scale, v * scale, w * scale}; }
};

/// The displacement's position and rotation as a pose.
inline Pose pose_of(const Shift& shift) {
  return {shift.p, quaternion_of(shift.theta)};
}
/// Displacement from `from` to `to`.
Shift shift_between(const RigidState& from, const RigidState& to) noexcept;

/// Rate of the correction and its limits.
struct ReconcilerSettings {
  double time_constant_s = 0.1;  ///< without a delay
  /// Additional time constant in loop delays. An immediate correction of an oscillating body would return a part of the
  /// oscillation later with the opposite sign. With 1/τ below 2 ζ ω of every oscillation the loop is stable at any
  /// phase.
  double loops = 5;
  double speed_limit_m_per_s = 0.05;  ///< limit of the correction: felt as a slow drift, not as a jerk
  double turn_limit_rad_per_s = 0.5;  ///< same for rotation
  double dead_zone_m = 0;             ///< smaller differences are not corrected (for a tool that its coupling holds)
  double dead_zone_rad = 0;
};

/// Correction of one body or tool.
///
/// Model   C is the sum of all shifts so far, stored with every input. The error e is the server's state for input k
///         less the model's at k, which already contained C(k). The required sum is thus C(k) + e, and C(k) + e − C is
///         missing now. Corrections that are not yet visible in the server's answers are therefore not applied twice.
///         In each tick a share h/τ of the missing part is applied, within the limits; τ = time_constant + loops ·
///         delay.
/// Source  a Smith predictor's inner difference; the bookkeeping by cumulative sums is ours
/// Thread  haptic: no allocation; finite for finite input
class Reconciler {
 public:
  explicit Reconciler(const ReconcilerSettings& settings) : settings_(settings) {}

  /// Records the server's state `server` for an input at which the model was at `then`, with a total shift of
  /// `given_then`.
  void observe(const RigidState& server, const RigidState& then, const Shift& given_then) noexcept;
  /// Returns the shift to apply in this tick.
  /// In      loop_s  delay from an input to the server's answer to it
  Shift step(double period_s, double loop_s) noexcept;
  /// Sum of all shifts so far.
  const Shift& given() const { return given_; }
  /// Length of the last observed position difference [m].
  double error_m() const { return error_m_; }
  void reset() noexcept { *this = Reconciler(settings_); }

 private:
  ReconcilerSettings settings_;
  Shift given_;
  Shift wanted_;
  double error_m_ = 0;
};

}  // namespace tandem::client
