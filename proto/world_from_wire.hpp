// What a complete scene says of a world in plain numbers; shapes, masses and molecules are added by whoever has them:
// the server from files, a client from assets.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/base/mass_properties.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/physics/world_description.hpp"
#include "tandem/control.pb.h"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// Everything but each body's and tool's touch, mass and molecule, and the fit of an adaptive law.
/// In      scene  complete; its numbers are taken as they are
physics::WorldDescription world_from_wire(const wire::Scene& scene);

/// What is wrong with a scene's molecular field beside its numbers (scene_ranges.hpp); empty: nothing.
/// In      path  with which the text begins; "": with the field
std::string find_molecular_problem(const wire::Scene& scene, const std::string& path = "");

/// What is wrong with how mass is spread, as sent: a number that is out of its range (scene_ranges.hpp), a part that is
/// lacking, axes that are not of unit length; empty when there is nothing. A mass of 0 stands alone.
///
/// In      path  of the message, with which the text begins, e.g. "tool_masses[0]"
std::string find_mass_problem(const wire::MassProperties& message, const std::string& path);
/// None when find_mass_problem() says what is wrong.
std::optional<MassProperties> mass_from_wire(const wire::MassProperties& message);

/// Of a sphere, box, cylinder or capsule; null for another kind. One that is alike and in use is that one.
/// Thread  any, at the same time
/// Fails   std::invalid_argument as the makers of common/contact do
std::shared_ptr<const contact::ContactShape> primitive_contact(const wire::Shape& shape);

/// A part for each shape, none for a null one.
physics::TouchModel touch_model_of(std::vector<physics::TouchModel::Part> parts, double stiffness_n_per_m3);

}  // namespace tandem::proto
