// Moves the bodies that no tool touches, with the same solver as the touch stage.
#pragma once

#include <memory>

#include "common/physics/free_bodies.hpp"
#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// Creates the component that steps the free bodies of `world`. `world` must outlive it.
///
/// Model   Contact, friction and anchors are computed by the solver of the touch stage (touch/touch_stage.hpp). A body
///         therefore behaves in the same way whether a tool touches it or not.
///         Impact (Newton's law): the bodies separate at restitution times the speed of approach. The restitution of a
///         pair is the larger of the two bodies' values. At the end of the compression, an additional impulse in the
///         direction of the compression's impulse gives the bodies this speed
/// Sleep   Bodies in contact with each other form a group. A group sleeps, i.e. is not stepped, after all its bodies
///         were slower than 0.02 mm/s and 0.5 mrad/s for 0.5 s. The whole group is woken by a wrench, a changed state,
///         the removal of a body or a new contact
/// Thread  any, one at a time; no allocation after construction
std::unique_ptr<FreeBodies> make_untouched_bodies(const WorldDescription& world);

}  // namespace tandem::physics
