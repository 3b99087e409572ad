// No kick where a stage changes its mind: the difference between what was shown and what comes next fades away.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Fades jumps of a wrench.
///
/// Model   shown = target + o, with ö = −2ω ȯ − ω² o (critically damped, solved exactly for any period); jump() adds
///         (from − to) to o and leaves ȯ, so shown and its slope go on through a jump that target makes from `from`
///         to `to`.
///         Bounds: after a jump Δ from rest o falls monotonically and by at most |Δ| ω T / e in a period T, 3 % of it
///         at the default and 1 ms; 10 % of Δ is left after 3.9 / ω = 49 ms, 1 % after 6.6 / ω = 83 ms. Jumps add up.
/// Thread  haptic: no allocation, no throw; a jump that is not finite is ignored
class ForceBlend {
 public:
  /// Of ω, per second; faster is sooner true and a steeper change.
  static constexpr double kRate = 80.0;

  /// The target is about to change from one rule's value to another's, both of this tick.
  void jump(const Wrench& from, const Wrench& to) noexcept;
  /// Once a tick, before apply().
  void advance(double period_s) noexcept;
  Wrench apply(const Wrench& target) const noexcept { return target + offset_; }
  void reset() noexcept { *this = ForceBlend(); }

  /// What is still to fade.
  const Wrench& offset() const noexcept { return offset_; }

 private:
  Wrench offset_;
  Wrench slope_;  ///< per second
};

}  // namespace tandem::client
