// No kick where a stage changes its mind: the difference between what was shown and what comes next fades away.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Fades jumps of a wrench.
///
/// Model   shown = target + o, with ö = −2ω ȯ − ω² o (critically damped, solved exactly for any period); jump() adds
///         (shown before − target) to o and leaves ȯ, so shown and its slope go on through a jump of the target.
///         Where the target itself comes back along o (a tool that was put elsewhere springs to its handle), o gives
///         way by as much: a jump that is undone makes no force the other way.
///         Bounds: after a jump Δ from rest o falls monotonically and by at most |Δ| ω T / e in a period T, 3 % of it
///         at the default and 1 ms; 10 % of Δ is left after 3.9 / ω = 49 ms, 1 % after 6.6 / ω = 83 ms. Jumps add up.
/// Thread  haptic: no allocation, no throw
class ForceBlend {
 public:
  /// Of ω, per second; faster is sooner true and a steeper change.
  static constexpr double kRate = 80.0;

  explicit ForceBlend(double rate_per_s = kRate) noexcept : rate_per_s_(rate_per_s) {}

  /// The next target is another rule's than the last one was.
  void jump() noexcept { jumps_ = true; }
  /// Once a tick, before apply().
  void advance(double period_s) noexcept;
  /// What is shown; once a tick. A target that is not finite is shown as it is, and forgotten.
  Wrench apply(const Wrench& target) noexcept;
  void reset() noexcept { *this = ForceBlend(rate_per_s_); }

  /// What is still to fade.
  const Wrench& offset() const noexcept { return offset_; }

 private:
  double rate_per_s_;
  Wrench offset_;
  Wrench slope_;   ///< per second
  Wrench target_;  ///< last
  bool jumps_ = false;
};

}  // namespace tandem::client
