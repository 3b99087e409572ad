// Converts a complete scene to the description of a world. The caller adds shapes, masses and molecules: the server
// obtains them from files, a client from assets.
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

/// Returns the description of the world, still without the touch models, masses and molecules of bodies and tools, and
/// without the fit of an adaptive law.
/// In      scene  complete scene; the ranges of its numbers are not checked here
physics::WorldDescription world_from_wire(const wire::Scene& scene);

/// Describes a problem of a scene's molecular field, except for ranges of numbers (scene_ranges.hpp). Returns an empty
/// text if there is none.
/// In      path  prefix of field names in the text; "": the text begins with the field name
std::string find_molecular_problem(const wire::Scene& scene, const std::string& path = "");

/// Describes a problem of received mass properties: a number out of range (scene_ranges.hpp), a missing part, or a
/// quaternion that is not of unit length. Returns an empty text if there is none. If the mass is 0, the remaining
/// fields are not checked.
///
/// In      path  name of the message for the text, e.g. "tool_masses[0]"
std::string find_mass_problem(const wire::MassProperties& message, const std::string& path);
/// Converts mass properties; returns nothing if find_mass_problem() finds a problem.
std::optional<MassProperties> mass_from_wire(const wire::MassProperties& message);

/// Returns the contact shape of a sphere, box, cylinder or capsule; null for any other kind. If an equal shape is in
/// use, returns that shape.
/// Thread  any, concurrently
/// Fails   std::invalid_argument: as for the functions in common/contact that create the shape
std::shared_ptr<const contact::ContactShape> primitive_contact(const wire::Shape& shape);

/// Returns a touch model with one part per shape; parts whose shape is null are omitted.
physics::TouchModel touch_model_of(std::vector<physics::TouchModel::Part> parts, double stiffness_n_per_m3);

}  // namespace tandem::proto
