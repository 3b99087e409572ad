// What a complete scene says of a world in plain numbers; shapes, masses and molecules are added by whoever has them:
// the server from files, a client from assets.
#pragma once

#include <memory>

#include "common/contact/contact_shape.hpp"
#include "common/physics/world_description.hpp"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// Everything but each body's and tool's touch, mass and molecule, and the fit of an adaptive law.
/// In      scene  complete; its numbers are taken as they are
physics::WorldDescription world_from_wire(const wire::Scene& scene);

/// Of a sphere, box, cylinder or capsule; null for another kind.
/// Fails   std::invalid_argument as the makers of common/contact do
std::shared_ptr<const contact::ContactShape> primitive_contact(const wire::Shape& shape);

/// A part for each shape, none for a null one.
physics::TouchModel touch_model_of(std::vector<physics::TouchModel::Part> parts, double stiffness_n_per_m3);

}  // namespace tandem::proto
