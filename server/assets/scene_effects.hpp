// Effects in scene files: defaults, and remedies for wrong names. proto/effects_from_wire.hpp has the checks.
#pragma once

#include <string>

#include "tandem/scene.pb.h"

namespace tandem::server {

/// Fills in the defaults that the table of ranges does not have: placements, in_contact, the force after slipping.
void complete_effects(wire::Scene& scene);

/// Remedy for an unknown field of an effect; "" for a field elsewhere.
std::string unknown_effect_field_remedy(const std::string& field);

}  // namespace tandem::server
