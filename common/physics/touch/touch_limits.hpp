// Capacities of a touch stage for a scene. Private to the world.
#pragma once

#include <span>

#include "common/physics/touch/touch_stage.hpp"
#include "common/physics/world_description.hpp"

namespace tandem::physics {

/// Returns the capacities for all bodies of `world` and the given tools. The capacity for pairs of shapes is the number
/// of pairs that can be close at the same time, but not more than the scene's limit, because each pair needs 0.7 MB.
TouchStage::Limits touch_limits(const WorldDescription& world, std::span<const ToolDescription> tools);

}  // namespace tandem::physics
