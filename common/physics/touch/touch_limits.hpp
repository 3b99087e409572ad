// Capacities of a touch stage for the things of a scene. Private to the world.
#pragma once

#include <span>

#include "common/physics/touch/touch_stage.hpp"
#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// For all bodies of `world` and these tools. Pairs of shapes: as many as can be near each other at the same time, each of
/// 0.7 MB, or the scene's limit.
TouchStage::Limits touch_limits(const WorldDescription& world, std::span<const ToolDescription> tools);

}  // namespace tandem::physics
