// Reconciliation of model and server at the same input. A received server state answers an input that is one round trip
// old. This state is compared with the model's state at the same input. The difference is the model's error and does
// not depend on the delay. The error is removed gradually.
#pragma once

#include "common/base/spatial.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// Difference of two rigid states, in W. It can be added to a pose and a twist.
struct Shift {
  Vec3 p = Vec3::Zero();      ///< translation [m]
  Vec3 theta = Vec3::Zero();  ///< rotation vector [rad]
  Vec3 v = Vec3::Zero();      ///< change of the linear velocity [m/s]
  Vec3 w = Vec3::Zero();      ///< change of the angular velocity [rad/s]

  Shift operator+(const Shift& other) const { return {p + other.p, theta + other.theta, v + other.v, w + other.w}; }
  Shift operator-(const Shift& other) const { return {p - other.p, theta - other.theta, v - other.v, w - other.w}; }
  Shift operator*(double scale) const { return {p * scale, theta * scale, v * scale, w * scale}; }
};

/// Returns translation and rotation of the shift as a pose.
inline Pose pose_of(const Shift& shift) {
  return {shift.p, quaternion_of(shift.theta)};
}
/// Returns the shift that leads from state `from` to state `to`.
Shift shift_between(const RigidState& from, const RigidState& to) noexcept;

/// Settings of the correction: its rate and its limits.
struct ReconcilerSettings {
  double time_constant_s = 0.1;  ///< time constant of the correction at zero delay
  /// Additional time constant, as a multiple of the loop delay. Without it, the correction of an oscillating body would
  /// include a part of an old oscillation with the opposite sign. Let τ be the total time constant. The loop is stable
  /// if 1/τ is below 2ζω for every oscillation with damping ratio ζ and frequency ω.
  double loops = 5;
  /// Speed limit of the correction; a slow correction is felt as drift, a fast one would be felt as a jerk
  double speed_limit_m_per_s = 0.05;
  double turn_limit_rad_per_s = 0.5;  ///< speed limit of the correction for rotation
  double dead_zone_m = 0;             ///< position difference below which nothing is corrected (used for tools)
  double dead_zone_rad = 0;           ///< rotation difference below which nothing is corrected
};

/// Computes the gradual correction of one body or tool.
///
/// Model   C  sum of all shifts so far; its value C(k) at input k is stored with the input
///         e  error: the server's state for input k minus the model's state at k. This model state contained C(k)
///         h  period
///         τ  time_constant + loops · delay
///         The sum of shifts must become C(k) + e, so the remaining part is C(k) + e − C. It does not contain
///         corrections applied after input k, so none is applied twice. In each tick the fraction h/τ of the remaining
///         part is applied, within the limits.
/// Source  inner difference of a Smith predictor; the use of cumulative sums is our addition
/// Thread  haptic: no allocation; finite for finite input
class Reconciler {
 public:
  explicit Reconciler(const ReconcilerSettings& settings) : settings_(settings) {}

  /// Records the server's state that answers an input. `then` is the model's state at this input, and `given_then` is
  /// the sum of all shifts up to this input.
  void observe(const RigidState& server, const RigidState& then, const Shift& given_then) noexcept;
  /// Returns the shift that the caller must apply in this tick.
  /// In      loop_s  loop delay: time from an input to the use of the server's answer to this input [s]
  Shift step(double period_s, double loop_s) noexcept;
  /// Returns the sum of all shifts so far.
  const Shift& given() const { return given_; }
  /// Returns the length of the last observed position difference [m].
  double error_m() const { return error_m_; }
  void reset() noexcept { *this = Reconciler(settings_); }

 private:
  ReconcilerSettings settings_;
  Shift given_;
  Shift wanted_;
  double error_m_ = 0;
};

}  // namespace tandem::client
