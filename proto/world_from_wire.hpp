// Conversion of a complete scene to the description of a world. Shapes, masses and molecules are added by the caller:
// the server takes them from files, a client from assets.
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

/// Returns the world without touch, mass and molecule of bodies and tools, and without the fit of an adaptive law.
/// In      scene  complete; its numbers are not checked
physics::WorldDescription world_from_wire(const wire::Scene& scene);

/// Returns a problem of a scene's molecular field other than its numbers (scene_ranges.hpp); empty: none.
/// In      path  prefix of the text; "": the text begins with the field
std::string find_molecular_problem(const wire::Scene& scene, const std::string& path = "");

/// Returns a problem of received mass properties: a number out of its range (scene_ranges.hpp), a missing part, or a
/// quaternion that is not of unit length; empty: none. With a mass of 0 the rest is not checked.
///
/// In      path  prefix of the text, naming the message, e.g. "tool_masses[0]"
std::string find_mass_problem(const wire::MassProperties& message, const std::string& path);
/// Returns nothing when find_mass_problem() finds a problem.
std::optional<MassProperties> mass_from_wire(const wire::MassProperties& message);

/// Returns the contact shape of a sphere, box, cylinder or capsule; null for another kind. Equal shapes in use are
/// shared.
/// Thread  any, concurrently
/// Fails   std::invalid_argument like the makers of common/contact
std::shared_ptr<const contact::ContactShape> primitive_contact(const wire::Shape& shape);

/// Returns a touch model with one part for each shape; null shapes are skipped.
physics::TouchModel touch_model_of(std::vector<physics::TouchModel::Part> parts, double stiffness_n_per_m3);

}  // namespace tandem::proto
