// What soft bodies do to a rigid thing between two soft steps: a force with its derivative, used only where it holds.
#pragma once

#include "common/base/touch_exchange.hpp"

namespace tandem::physics {

/// The soft bodies' wrench on T about its origin, now that T is at `X_WT`.
///
/// Model   W = W₀ − K (X − X₀). Along W₀'s force the contact is a spring: pressed deeper it grows, up to 50 mm; moved
///         out it falls, and never pulls: where the part of W along W₀'s force has fallen below a quarter of W₀'s, W is
///         scaled down with it, to zero where it would turn. To the sides, turns included, it is used no farther than
///         the trust radius, and fades to zero between that and four times it: T has left. Continuous everywhere.
/// Limit   a thing squeezed from two sides at once is held weakly: the net force is all that "pulls" is judged by
/// Thread  any; no allocation, finite for finite input
Wrench soft_wrench(const SoftContact& contact, const Pose& X_WT) noexcept;

}  // namespace tandem::physics
