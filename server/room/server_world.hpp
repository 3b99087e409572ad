// Builds the world of a room from its scene: rigid bodies, tools, and soft bodies if the scene has any.
#pragma once

#include "common/physics/world.hpp"
#include "server/assets/scene_file.hpp"
#include "server/physics/soft_world.hpp"

namespace tandem::server {

physics::World make_server_world(const std::shared_ptr<const LoadedScene>& scene, bool steps_soft_aside = false);

/// Measures several steps of a scene with every tool at its start pose. Returns the shortest measured step time, a
/// lower bound of the step time on this machine.
Duration quickest_step(const std::shared_ptr<const LoadedScene>& scene);

}  // namespace tandem::server
