// An effect and what it belongs to.
#pragma once

#include <optional>

#include "common/physics/effects/effect_settings.hpp"

namespace tandem::physics {

struct SceneEffect {
  std::optional<std::size_t> body;  ///< that it belongs to; none: the scene
  EffectSettings settings;
};

}  // namespace tandem::physics
