// What soft bodies do to a rigid thing between two soft steps: a force with its derivative, used only where it holds.
#pragma once

#include "common/base/spatial.hpp"
#include "common/contact/contact_reduction.hpp"

namespace tandem::physics {

/// The contact of one rigid thing T with all soft bodies, linearised at the pose that the soft step was made with. Or,
/// of a T that does not touch yet, the contact that it is going to have, linearised at a pose within the soft body.
struct SoftContact {
  Wrench wrench_W;  ///< on T at X_WT0, about its origin: impulse of the soft step over its length
  contact::Matrix6 stiffness =
      contact::Matrix6::Zero();  ///< −∂W/∂X, symmetric, never negative; translation [m], then rotation [rad]
  Pose X_WT0;                    ///< where T was, or will be
  double trust_radius_m = 0;     ///< how far T may move aside until the contact is another one; 0: none, nor near
  double lever_m = 0;            ///< a turn by θ counts as a way of lever · θ
};

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
