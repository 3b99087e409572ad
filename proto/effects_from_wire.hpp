// Effects of a complete scene as the world uses them, for server and client, which do not depend on each other.
#pragma once

#include <string>
#include <vector>

#include "common/physics/effects/effect_settings.hpp"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// Largest number of effects of a scene and its bodies together: a local model evaluates them in the haptic tick.
inline constexpr int kMaxEffects = 32;

/// Returns the settings of an effect; absent numbers count as 0.
physics::EffectSettings settings_of(const wire::Effect& effect);

/// Checks the number of effects and the combination of each effect's numbers; scene_ranges.hpp has the range of each.
///
/// Out     "bodies[0].effects[1].region is given; it must be ...", of the first unusable effect; empty: none
std::string find_effect_problem(const wire::Scene& scene);

/// Returns all effects: first those of the bodies, each group in the order of the scene.
/// In      scene  complete
std::vector<physics::EffectSettings> effects_of(const wire::Scene& scene);

}  // namespace tandem::proto
