// Nudge: force pulses towards a position at which another user points.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Computes the force pulses of the nudge on the hand.
///
/// Model   Three pulses of sin² shape, each of 0.08 s, one every 0.25 s. Their direction is fixed at the start. The
///         pulses do not depend on the hand's motion, so they cannot cause oscillation. The amplitude is 0.3 N, or a
///         tenth of the device's force limit if that is less. The amplitude is our choice: a force that is just
///         noticeable
/// Thread  haptic: no allocation, no throw
class Nudge {
 public:
  /// In      force_limit_n  force limit of the device
  explicit Nudge(double force_limit_n) noexcept;

  /// Starts the pulses. The call is ignored while pulses are running.
  /// In      way_W  vector from the handle to the position; if it is zero or not finite, no pulses are started
  ///         q_DW   rotation from the world to the device's base
  void begin(const Vec3& way_W, const Quat& q_DW) noexcept;
  /// Computes the force of the next period.
  /// In      may_push  false: ends the pulses
  void advance(double period_s, bool may_push) noexcept;

  bool is_running() const noexcept { return !direction_D_.isZero(0); }
  /// Returns the force of this period [N], in D.
  const Vec3& on_hand_D() const noexcept { return on_hand_D_; }

 private:
  double amplitude_n_;
  Vec3 direction_D_ = Vec3::Zero();  ///< unit vector of the pulses; zero if none are running
  Vec3 on_hand_D_ = Vec3::Zero();
  double elapsed_s_ = 0;
};

}  // namespace tandem::client
