// A pose that is followed so gently that what follows it cannot ring with it.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Two low passes in a row, and part of the way that they and the network cost added by the smoothed velocity.
///
/// Model   a' = (x − a)/τ, b' = (a − b)/τ, v = (a − b)/τ; shown: b + lead (delay + 2τ) v; rotations alike, by rotation
///         vectors. Two people who feel each other's things through a field close a loop over the network; this keeps
///         its gain below one from where their hands swing.
/// Thread  any; no allocation
class SmoothedMotion {
 public:
  static constexpr double kTimeConstant_s = 0.3;
  /// Of what is missing; 1 follows an even motion without lag, and rings (measured, docking).
  static constexpr double kLead = 0.25;

  void start_at(const Pose& X) noexcept { a_ = b_ = X; }
  RigidState step(const Pose& X, double delay_s, double period_s) noexcept {
    const double tau_s = kTimeConstant_s, part = period_s / tau_s;
    a_ = moved(a_, X, part);
    b_ = moved(b_, a_, part);
    const Twist V{(a_.p - b_.p) / tau_s, rotation_vector(a_.q * b_.q.conjugate()) / tau_s};
    return {integrate(b_, V, kLead * (delay_s + 2 * tau_s)), V};
  }

 private:
  static Pose moved(const Pose& from, const Pose& to, double part) noexcept {
    return {from.p + part * (to.p - from.p),
            (quaternion_of(part * rotation_vector(to.q * from.q.conjugate())) * from.q).normalized()};
  }

  Pose a_, b_;
};

}  // namespace tandem::client
