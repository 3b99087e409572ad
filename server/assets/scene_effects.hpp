// Effects in scene files: defaults, checks, and what the world makes of them.
#pragma once

#include <string>

#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// Of the step rate: what a sampled sinusoid needs to be one.
inline constexpr double kMaxVibrationShare = 0.4;

/// Fills in what the table of ranges does not: placements, in_contact, the force that is left after slipping.
void complete_effects(wire::Scene& scene);
/// In      scene  its numbers are complete and in their ranges
/// Fails   SceneError
void check_effects(const wire::Scene& scene, const SceneField& file);

/// What to say of a field of an effect that does not exist; "" for a field elsewhere.
std::string unknown_effect_field_remedy(const std::string& field);

}  // namespace tandem::server
