// Wrench of soft bodies on a rigid thing between two soft steps: linearised, with a limited range.
#pragma once

#include "common/base/touch_exchange.hpp"

namespace tandem::physics {

/// Returns the wrench of the soft bodies on T about its origin, with T at `X_WT`.
///
/// Model   W = W₀ − K (X − X₀), continuous everywhere. Along W₀'s force the contact is a spring: the force grows with
///         depth up to 50 mm and decreases outwards, but never pulls. Below a quarter of W₀'s force along that
///         direction, all of W is scaled down in proportion, to zero where it would change sign. Sideways and in
///         rotation the displacement is clamped to the trust radius. From there to four times the trust radius W fades
///         to zero, because T has left
/// Limit   a thing squeezed from two sides at once is held weakly, because the test for pulling uses the net force only
/// Thread  any; no allocation, finite for finite input
Wrench soft_wrench(const SoftContact& contact, const Pose& X_WT) noexcept;

}  // namespace tandem::physics
