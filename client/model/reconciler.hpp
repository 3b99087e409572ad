// The server's word on a thing answers an input that is one round trip old. Compared with what the model made of that
// same input, it says how wrong the model is, whatever the delay; the difference is then taken out without a step.
#pragma once

#include "common/base/spatial.hpp"
#include "proto/state.hpp"

namespace tandem::client {

/// A displacement of a rigid thing with its rates, all in W: added to its pose and twist.
struct Shift {
  Vec3 p = Vec3::Zero();      ///< [m]
  Vec3 theta = Vec3::Zero();  ///< rotation vector [rad]
  Vec3 v = Vec3::Zero();      ///< [m/s]
  Vec3 w = Vec3::Zero();      ///< [rad/s]

  Shift operator+(const Shift& other) const { return {p + other.p, theta + other.theta, v + other.v, w + other.w}; }
  Shift operator-(const Shift& other) const { return {p - other.p, theta - other.theta, v - other.v, w - other.w}; }
  Shift operator*(double scale) const { return {p * scale, theta * scale, v * scale, w * scale}; }
};

/// What takes `from` to `to`.
Shift shift_between(const RigidState& from, const RigidState& to) noexcept;

/// How quickly a difference is taken out, and how fast at most.
struct ReconcilerSettings {
  double time_constant_s = 0.1;  ///< without a delay
  /// And this times the loop's delay more. Taken out at once, an error of a thing that swings would come back a part of
  /// a swing later with the other sign; with 1/τ below 2 ζ ω of every swing the loop is stable whatever the phase.
  double loops = 5;
  double speed_limit_m_per_s = 0.05;  ///< of the correction: slow enough to be felt as a drift, not as a knock
  double turn_limit_rad_per_s = 0.5;  ///< likewise
  double dead_zone_m = 0;             ///< smaller differences are left alone (of a thing that its coupling holds)
  double dead_zone_rad = 0;
};

/// One thing's correction.
///
/// Model   C is the sum of all shifts so far, remembered with every input. The server's state for input k, less the
///         model's at k, is what the model then lacked beside C(k): so C ought to have been C(k) + e, and what is
///         missing now is C(k) + e − C. Corrections that are still under way to be seen are thereby not given twice.
///         A share h/τ of what is missing is given in a tick, at most the limit; τ = time_constant + loops · delay.
/// Source  a Smith predictor's inner difference; the bookkeeping by cumulative sums is ours
/// Thread  haptic: no allocation; finite for finite input
class Reconciler {
 public:
  explicit Reconciler(const ReconcilerSettings& settings) : settings_(settings) {}

  /// The server's `server` answers an input at which the model was at `then`, shifted by `given_then` in all.
  void observe(const RigidState& server, const RigidState& then, const Shift& given_then) noexcept;
  /// What to shift the thing by in this tick.
  /// In      loop_s  delay from an input to the server's answer to it
  Shift step(double period_s, double loop_s) noexcept;
  /// Everything given so far.
  const Shift& given() const { return given_; }
  /// The last difference of positions that was observed [m].
  double error_m() const { return error_m_; }
  void reset() noexcept { *this = Reconciler(settings_); }

 private:
  ReconcilerSettings settings_;
  Shift given_;
  Shift wanted_;
  double error_m_ = 0;
};

}  // namespace tandem::client
