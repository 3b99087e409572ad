// Moves the bodies that no tool touches, with the same solver as the touch stage.
#pragma once

#include <memory>

#include "common/physics/free_bodies.hpp"
#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// Creates the component that steps the free bodies of `world`. `world` must outlive it.
///
/// Model   The solver of the touch stage (touch/touch_stage.hpp) computes contact, friction and anchors, so a body
///         behaves in the same way whether a tool touches it or not. The restitution of a pair is the larger of the two
///         bodies' values. At the end of the compression, the pair receives the impulse of the compression once more,
///         scaled such that the bodies separate at restitution times the speed of approach (Newton's law of impact)
/// Sleep   Bodies that are in contact with each other form a group. A group that was slower than 0.02 mm/s and 0.5
///         mrad/s for 0.5 s sleeps, i.e. is not stepped. A wrench, a changed state, the removal of a body or a new
///         contact wakes the whole group
/// Thread  any, one at a time; no allocation after construction
std::unique_ptr<FreeBodies> make_untouched_bodies(const WorldDescription& world);

}  // namespace tandem::physics
