#include "server/physics/server_world.hpp"

#include "proto/world_from_wire.hpp"
#include "server/assets/soft_scene.hpp"
#include "server/physics/bullet_world.hpp"
#include "server/physics/soft_world.hpp"

namespace tandem::server {

std::shared_ptr<const physics::WorldDescription> world_description(const LoadedScene& scene) {
  auto world = std::make_shared<physics::WorldDescription>(proto::world_from_wire(scene.description));
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    world->bodies[i].touch = scene.bodies[i].touch;
    world->bodies[i].mass = scene.bodies[i].mass;
    world->bodies[i].molecule = scene.bodies[i].molecule;
  }
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    world->tools[i].touch = scene.tools[i].touch;
    world->tools[i].mass = scene.tools[i].mass;
  }
  world->coupling = scene.coupling;
  return world;
}

physics::World make_server_world(const std::shared_ptr<const LoadedScene>& scene, SoftStepping soft_stepping) {
  std::unique_ptr<physics::SoftBodies> soft;
  if (!scene->soft_bodies.empty()) {
    const bool is_inline = soft_stepping == SoftStepping::kInline;
    soft = std::make_unique<SoftWorld>(soft_world_settings(*scene),
                                       is_inline ? SoftWorld::Execution::kInline : SoftWorld::Execution::kWorker);
  }
  return physics::World(world_description(*scene), std::make_unique<BulletWorld>(scene), std::move(soft));
}

}  // namespace tandem::server
