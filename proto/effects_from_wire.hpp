// Converts the effects of a complete scene to the form used by the physics. Server and client share this code, because
// neither depends on the other.
#pragma once

#include <string>
#include <vector>

#include "common/physics/effects/effect_settings.hpp"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// Maximum number of effects of a scene, including those of its bodies. It bounds the cost of a haptic tick, in which a
/// local model evaluates all effects.
inline constexpr int kMaxEffects = 32;

/// Returns the settings of an effect; absent numbers are treated as 0.
physics::EffectSettings settings_of(const wire::Effect& effect);

/// Checks the number of effects, and the combinations of numbers within each effect. scene_ranges.hpp checks the range
/// of each single number.
///
/// Out     problem of the first unusable effect, e.g. "bodies[0].effects[1].region is given; it must be ..."; empty if
///         all are usable
std::string find_effect_problem(const wire::Scene& scene);

/// Returns all effects: those of the bodies in the order of the bodies, then those of the scene.
/// In      scene  complete scene
std::vector<physics::EffectSettings> effects_of(const wire::Scene& scene);

}  // namespace tandem::proto
