// Steps the bodies that no tool touches with the solver of the touch stage.
#pragma once

#include <memory>

#include "common/physics/free_bodies.hpp"
#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// Steps the free bodies of `world`, which must outlive it.
///
/// Model    contact, friction and anchors by the touch stage (touch/touch_stage.hpp), so a body behaves alike in both
///          stages. Restitution is the larger one of both bodies. At the end of a compression the pair receives the
///          impulse of that compression once more. The impulse is scaled so that the bodies separate at restitution
///          times the speed at which they met (Newton's law of impact).
/// Sleeping a group of bodies that press on each other and were slower than 0.02 mm/s and 0.5 mrad/s for 0.5 s is
///          not stepped. A wrench, a changed state, a removed member or a contact wakes the whole group.
/// Thread   one at a time; no allocation after construction
std::unique_ptr<FreeBodies> make_untouched_bodies(const WorldDescription& world);

}  // namespace tandem::physics
