// Blends the force where a stage changes its rule: the difference to the previously displayed force fades away.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Fades jumps of a wrench.
///
/// Model   shown = target + o, with ö = −2ω ȯ − ω² o (critically damped, solved exactly for any period). jump() adds
///         (shown before − target) to o and leaves ȯ, so shown and its slope are continuous through a jump of the
///         target.
///         Where the target itself moves along o (a relocated tool springs back to its handle), o shrinks by as much.
///         A jump that is undone thus causes no force in the opposite direction.
///         Bounds: after a jump Δ from rest o falls monotonically and by at most |Δ| ω T / e in a period T, 3 % of it
///         at the default and 1 ms; 10 % of Δ is left after 3.9 / ω = 49 ms, 1 % after 6.6 / ω = 83 ms. Jumps add up.
/// Thread  haptic: no allocation, no throw
class ForceBlend {
 public:
  /// ω [1/s]; a larger value fades sooner with a steeper change.
  static constexpr double kRate = 80.0;

  explicit ForceBlend(double rate_per_s = kRate) noexcept : rate_per_s_(rate_per_s) {}

  /// The next target follows another rule than the last one.
  void jump() noexcept { jumps_ = true; }
  /// Must be called once a tick, before apply().
  void advance(double period_s) noexcept;
  /// Returns the wrench to display; once a tick. A target that is not finite is returned unchanged and not stored.
  Wrench apply(const Wrench& target) noexcept;
  void reset() noexcept { *this = ForceBlend(rate_per_s_); }

  /// Difference that is still fading.
  const Wrench& offset() const noexcept { return offset_; }

 private:
  double rate_per_s_;
  Wrench offset_;
  Wrench slope_;   ///< [1/s]
  Wrench target_;  ///< last target
  bool jumps_ = false;
};

}  // namespace tandem::client
