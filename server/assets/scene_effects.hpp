// Effects in scene files: defaults, and remedies for wrong names. proto/effects_from_wire.hpp contains the checks.
#pragma once

#include <string>

#include "tandem/scene.pb.h"

namespace tandem::server {

/// Fills in the defaults that the table of ranges (proto/scene_ranges.hpp) lacks: placements, the field in_contact, and
/// the force after slipping.
void complete_effects(wire::Scene& scene);

/// Returns the remedy for an unknown field of an effect; an empty string if the field is not in an effect.
std::string unknown_effect_field_remedy(const std::string& field);

}  // namespace tandem::server
