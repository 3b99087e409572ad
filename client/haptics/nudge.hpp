// Force pulses that direct the user's attention to a place that another user points at.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Force of the nudge on the hand.
///
/// Model   three pulses sin² of 0.08 s each, 0.25 s apart, in a direction that is fixed at the start. They do not
///         depend on the hand's motion, so they cannot oscillate with it. The amplitude is 0.3 N, or a tenth of the
///         device's limit if that is less: just noticeable. The amplitude is our choice.
/// Thread  haptic: no allocation, no throw
class Nudge {
 public:
  /// In      force_limit_n  limit of the device
  explicit Nudge(double force_limit_n) noexcept;

  /// Starts the pulses. Running pulses are not interrupted: the call is then ignored.
  /// In      way_W  from the handle to the place; one that is zero or not finite starts nothing
  ///         q_DW   rotation from the world to the device's base
  void begin(const Vec3& way_W, const Quat& q_DW) noexcept;
  /// Computes the force of the next period.
  /// In      may_push  false: ends the pulses
  void advance(double period_s, bool may_push) noexcept;

  bool is_running() const noexcept { return !direction_D_.isZero(0); }
  /// Force of this period [N], in D.
  const Vec3& on_hand_D() const noexcept { return on_hand_D_; }

 private:
  double amplitude_n_;
  Vec3 direction_D_ = Vec3::Zero();  ///< zero: no pulses
  Vec3 on_hand_D_ = Vec3::Zero();
  double elapsed_s_ = 0;
};

}  // namespace tandem::client
