// Fades out the force difference that arises when a stage changes the rule by which it computes the force.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Makes a displayed wrench continuous across jumps of its target.
///
/// Model   displayed = target + o
///         o  offset, with ö = −2ω ȯ − ω² o: critically damped, solved exactly for any period
///         ω  rate of the blend (kRate)
///         jump() adds (previously displayed − target) to o and keeps ȯ. So the displayed wrench and its slope are
///         continuous when the target jumps.
///         If the target itself moves in the direction of o (a relocated tool springs back to its handle), o is reduced
///         by the same amount. When a jump is reversed, this prevents a force in the opposite direction.
///         Bounds: after a jump Δ from rest, |o| falls monotonically, by at most |Δ| ω T / e in a period T (e = 2.718).
///         This is 3 % of Δ for the default ω and T = 1 ms. 10 % of Δ is left after 3.9 / ω = 49 ms, and 1 % after
///         6.6 / ω = 83 ms. The offsets of several jumps add up.
/// Thread  haptic: no allocation, no throw
class ForceBlend {
 public:
  /// Rate ω [1/s]. A larger value makes the fade shorter and steeper.
  static constexpr double kRate = 80.0;

  explicit ForceBlend(double rate_per_s = kRate) noexcept : rate_per_s_(rate_per_s) {}

  /// Must be called before apply() if the next target is computed by a different rule than the last one.
  void jump() noexcept { jumps_ = true; }
  /// Must be called once a tick, before apply().
  void advance(double period_s) noexcept;
  /// Returns the wrench to display. Must be called once a tick. A target that is not finite is returned unchanged and
  /// not stored.
  Wrench apply(const Wrench& target) noexcept;
  void reset() noexcept { *this = ForceBlend(rate_per_s_); }

  /// Returns the remaining difference between the displayed wrench and the target.
  const Wrench& offset() const noexcept { return offset_; }

 private:
  double rate_per_s_;
  Wrench offset_;
  Wrench slope_;   ///< rate of change of the offset
  Wrench target_;  ///< target of the last apply()
  bool jumps_ = false;
};

}  // namespace tandem::client
