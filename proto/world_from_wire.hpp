// Converts a complete scene to a WorldDescription. Shapes, masses and molecules are not contained in it: the caller
// adds them, from files at the server or from assets at a client.
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

/// Returns the description of the world. The caller must add the touch models, masses and molecules of bodies and
/// tools, and the fit of an adaptive law.
/// In      scene  complete scene; the ranges of its numbers are not checked here
physics::WorldDescription world_from_wire(const wire::Scene& scene);

/// Returns a description of the first problem of a scene's molecular field; empty if there is none. Ranges of numbers
/// are not checked here (see scene_ranges.hpp).
/// In      path  prefix of field names in the text; "": the text begins with the field name
std::string find_molecular_problem(const wire::Scene& scene, const std::string& path = "");

/// Returns a description of the first problem of received mass properties; empty if there is none. Problems are: a
/// number out of range (scene_ranges.hpp), a missing part, and a quaternion that is not of unit length. If the mass is
/// 0, the other fields are not checked.
///
/// In      path  name of the message for the text, e.g. "tool_masses[0]"
std::string find_mass_problem(const wire::MassProperties& message, const std::string& path);
/// Converts mass properties; returns nothing if find_mass_problem() finds a problem.
std::optional<MassProperties> mass_from_wire(const wire::MassProperties& message);

/// Returns the contact shape of a sphere, box, cylinder or capsule; null for any other kind. Equal shapes are shared:
/// if one is in use, it is returned.
/// Thread  any, concurrently
/// Fails   std::invalid_argument: as for the functions in common/contact that create the shape
std::shared_ptr<const contact::ContactShape> primitive_contact(const wire::Shape& shape);

/// Returns a touch model with one part per shape. A part whose shape is null is omitted.
physics::TouchModel touch_model_of(std::vector<physics::TouchModel::Part> parts, double stiffness_n_per_m3);

}  // namespace tandem::proto
