// Effects of a complete scene, as the world uses them. Server and client both need it, and neither may use the other.
#pragma once

#include <string>
#include <vector>

#include "common/physics/effects/effect_settings.hpp"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// Of a scene and its bodies together: a local model evaluates them in the haptic tick.
inline constexpr int kMaxEffects = 32;

/// Numbers that are absent count as 0.
physics::EffectSettings settings_of(const wire::Effect& effect);

/// How many effects there may be, and what the numbers of each must be together; what each number may be alone is in
/// scene_ranges.hpp.
///
/// Out     "bodies[0].effects[1].region is given; it must be ...", of the first effect that cannot be used; empty when
///         all can
std::string find_effect_problem(const wire::Scene& scene);

/// Those of the bodies first, all in the order of the scene.
/// In      scene  complete
std::vector<physics::EffectSettings> effects_of(const wire::Scene& scene);

}  // namespace tandem::proto
