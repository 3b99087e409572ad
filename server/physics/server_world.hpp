// The world as a room has it: Bullet for the bodies that nobody touches, and the scene's soft bodies.
#pragma once

#include "common/physics/world.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::server {

/// How soft bodies are stepped: within World::step(), or by a thread of their own. Both give the same bits.
enum class SoftStepping { kInline, kWorker };

/// What the world needs of a scene; clients make the same from what they are sent.
std::shared_ptr<const physics::WorldDescription> world_description(const LoadedScene& scene);

physics::World make_server_world(const std::shared_ptr<const LoadedScene>& scene,
                                 SoftStepping soft_stepping = SoftStepping::kInline);

}  // namespace tandem::server
