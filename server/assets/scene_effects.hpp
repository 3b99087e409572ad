// Effects in scene files: defaults, and help with their names; what they must be is in proto/effects_from_wire.hpp.
#pragma once

#include <string>

#include "tandem/scene.pb.h"

namespace tandem::server {

/// Fills in what the table of ranges does not: placements, in_contact, the force that is left after slipping.
void complete_effects(wire::Scene& scene);

/// What to say of a field of an effect that does not exist; "" for a field elsewhere.
std::string unknown_effect_field_remedy(const std::string& field);

}  // namespace tandem::server
