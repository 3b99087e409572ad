#include "server/room/server_world.hpp"

#include "common/physics/untouched_bodies.hpp"
#include "server/assets/soft_scene.hpp"
#include "server/goals/game_plan.hpp"

namespace tandem::server {

physics::World make_server_world(const std::shared_ptr<const LoadedScene>& scene, bool steps_soft_aside) {
  std::unique_ptr<physics::SoftBodies> soft;
  if (!scene->soft_bodies.empty()) soft = std::make_unique<SoftWorld>(soft_world_settings(*scene), steps_soft_aside);
  // The description is a member of the scene. The pointer to it therefore shares the ownership of the scene.
  return physics::World(std::shared_ptr<const physics::WorldDescription>(scene, &scene->world),
                        physics::make_untouched_bodies(scene->world), std::move(soft));
}

Duration quickest_step(const std::shared_ptr<const LoadedScene>& scene) {
  physics::World world = make_server_world(scene, false);
  for (std::size_t tool = 0; tool < scene->world.tools.size(); ++tool) world.activate_tool(tool);
  // In a game, a room contains only the bodies of the current level. The bodies that the first level lacks are removed.
  if (const auto plan = make_game_plan(*scene)) {
    for (std::size_t body = 0; body < scene->world.bodies.size(); ++body) {
      if ((plan->levels.front().absent >> body & 1U) != 0) world.remove_body(body_id_at(body));
    }
  }
  return world.quickest_step();
}

}  // namespace tandem::server
