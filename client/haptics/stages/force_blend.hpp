// No kick where a stage changes its mind: from what was shown it goes over to what comes next.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::client {

/// Goes over jumps of a wrench.
///
/// Model   shown = target + w (held − target); jump() holds what was shown last and sets w = 1, which then falls as
///         w = (1 + ωt) e^(−ωt) (critically damped, exact for any period).
///         Bounds: shown lies between what is held and the target, so a target that comes back to what is held by
///         itself (a tool that springs to its handle) makes no force of its own; w falls by at most ω T / e in a period T,
///         3 % at the default and 1 ms; 10 % are left after 3.9 / ω = 49 ms, 1 % after 6.6 / ω = 83 ms. A jump amid
///         another holds what is shown then.
/// Thread  haptic: no allocation, no throw
class ForceBlend {
 public:
  /// Of ω, per second; faster is sooner true and a steeper change.
  static constexpr double kRate = 80.0;

  /// From this tick on the target is another rule's.
  void jump() noexcept;
  /// Once a tick, before apply().
  void advance(double period_s) noexcept;
  /// What is shown; once a tick. A target that is not finite is shown as it is, and not held.
  Wrench apply(const Wrench& target) noexcept;
  void reset() noexcept { *this = ForceBlend(); }

  /// What is left of what is held, 0 to 1.
  double share() const noexcept;

 private:
  static constexpr double kLong = 30;  ///< nothing is left

  Wrench shown_;
  Wrench held_;
  double turned_ = kLong;  ///< ωt
};

}  // namespace tandem::client
