#include "server/assets/soft_scene.hpp"

#include "proto/placement.hpp"
#include "server/assets/scene_soft_checks.hpp"

namespace tandem::server {
namespace {

SoftTraits traits_of(const wire::SoftBody& body) {
  SoftTraits traits;
  traits.mass_kg = body.mass_kg();
  traits.X_WS = proto::pose_from_placement(body.placement());
  traits.stiffness = body.stiffness();
  traits.damping = body.damping();
  traits.volume_stiffness = body.volume_stiffness();
  traits.friction = body.friction();
  for (const std::string& side : body.anchored()) {
    for (unsigned bit = 0; bit < std::size(kSoftSideNames); ++bit) {
      if (side == kSoftSideNames[bit]) traits.anchored = static_cast<SoftSides>(traits.anchored | 1U << bit);
    }
  }
  return traits;
}

void check_surface(const geometry::ContactMesh& mesh, const std::string& name, const SceneField& field) {
  if (mesh.kind != geometry::SurfaceKind::kSolid) {
    field.refuse("is " + name + ", which is open; a soft body needs a closed surface: close it, or use a block");
  }
  const std::size_t count = mesh.mesh.vertices.size();
  if (count > kMaxSoftNodes) {
    field.refuse("is " + name + ", which has " + std::to_string(count) + " vertices; at most " +
                 std::to_string(kMaxSoftNodes) + " are possible: simplify it");
  }
}

}  // namespace

SoftModel soft_model_of(const wire::SoftBody& body, const geometry::ContactMesh* mesh, const SceneField& field) {
  SoftModel model;
  if (mesh != nullptr) {
    check_surface(*mesh, body.mesh().file(), field.in("mesh").in("file"));
    model = make_soft_surface(mesh->mesh, traits_of(body));
  } else {
    const auto& size = body.block().size_m();
    model = make_soft_block(Vec3(size[0], size[1], size[2]), body.block().spacing_m(), traits_of(body));
  }
  model.name = body.name();
  return model;
}

std::string soft_note(const SoftModel& model, const wire::Scene& scene) {
  const int period = soft_period_steps(scene.step_rate_hz(), scene.soft_step_rate_hz());
  return model.name + ": soft, " + std::to_string(model.nodes_W.size()) + " nodes, " +
         std::to_string(model.links.size()) + " links, " + std::to_string(model.samples.size()) +
         " contact points; stepped every " + std::to_string(period) + " steps, at " +
         number_text(double(scene.step_rate_hz()) / period) +
         " Hz (requested: " + number_text(scene.soft_step_rate_hz()) + " Hz)";
}

SoftWorldSettings soft_world_settings(const LoadedScene& scene) {
  const wire::Scene& description = scene.description;
  SoftWorldSettings settings;
  settings.bodies = scene.soft_bodies;
  for (const physics::ToolDescription& tool : scene.world.tools) settings.tools.push_back({tool.touch, tool.friction});
  for (const physics::BodyDescription& body : scene.world.bodies) {
    const SoftRigid rigid{body.touch, body.traits.friction, body.X_WB};
    const bool is_static = body.mass.mass_kg <= 0;
    // A static body gets an empty entry in `tools`, so that the indices of the other bodies do not change.
    settings.tools.push_back(is_static ? SoftRigid{} : rigid);
    if (is_static && rigid.model.can_be_touched()) settings.obstacles.push_back(rigid);
  }
  settings.gravity_m_per_s2 = scene.world.gravity_m_per_s2;
  settings.room_rate_hz = description.step_rate_hz();
  settings.rate_hz = description.soft_step_rate_hz();
  settings.speed_limit_m_per_s = scene.world.limits.body_speed_m_per_s;
  return settings;
}

}  // namespace tandem::server
