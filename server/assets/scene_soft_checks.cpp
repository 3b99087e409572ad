#include "server/assets/scene_soft_checks.hpp"

#include <algorithm>
#include <set>
#include <string>

#include "server/assets/scene_checks.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {
namespace {

void complete(wire::SoftBlock& block, const SceneField& field) {
  if (block.size_m_size() != 3) {
    field.in("size_m").refuse("has " + std::to_string(block.size_m_size()) +
                              " numbers; it must have 3 (full edge lengths x, y, z)");
  }
  Vec3 size_m;
  for (int i = 0; i < 3; ++i) {
    field.in("size_m", static_cast<std::size_t>(i)).require_positive(block.size_m(i), 100);
    size_m[i] = block.size_m(i);
  }
  if (!block.has_spacing_m()) block.set_spacing_m(size_m.maxCoeff() / 8);
  field.in("spacing_m").require_within(block.spacing_m(), 1e-4, 100, "from 0.0001 to 100");
  const auto nodes = soft_block_nodes(soft_block_cells(size_m, block.spacing_m()));
  if (nodes > kMaxSoftNodes) {
    field.in("spacing_m")
        .refuse("is " + number_text(block.spacing_m()) + ", which makes " + std::to_string(nodes) + " nodes; at most " +
                std::to_string(kMaxSoftNodes) + " are possible: widen it");
  }
}

void complete_kind(wire::SoftBody& body, const SceneField& field) {
  switch (body.kind_case()) {
    case wire::SoftBody::kBlock:
      return complete(*body.mutable_block(), field.in("block"));
    case wire::SoftBody::kMesh:
      return check(*body.mutable_mesh(), field.in("mesh"));
    case wire::SoftBody::KIND_NOT_SET:
      break;
  }
  field.refuse("has no kind; it must have one of block, mesh");
}

void complete_material(wire::SoftBody& body, const SceneField& field) {
  const SoftMaterial fallback;
  if (!body.has_mass_kg()) body.set_mass_kg(SoftTraits{}.mass_kg);
  if (!body.has_stiffness()) body.set_stiffness(fallback.stiffness);
  if (!body.has_damping()) body.set_damping(fallback.damping);
  if (!body.has_volume_stiffness()) body.set_volume_stiffness(fallback.volume_stiffness);
  if (!body.has_friction()) body.set_friction(fallback.friction);
  field.in("mass_kg").require_positive(body.mass_kg(), 1e4);
  // Without links the body would be a cloud.
  field.in("stiffness").require_within(body.stiffness(), 1e-3, 1, "from 0.001 to 1");
  field.in("damping").require_at_least_zero(body.damping(), 1);
  field.in("volume_stiffness").require_at_least_zero(body.volume_stiffness(), 1);
  field.in("friction").require_at_least_zero(body.friction(), 10);
}

void check_anchored(const wire::SoftBody& body, const SceneField& field) {
  for (int i = 0; i < body.anchored_size(); ++i) {
    const std::string& side = body.anchored(i);
    const bool is_known = std::any_of(std::begin(kSoftSideNames), std::end(kSoftSideNames),
                                      [&side](const char* name) { return side == name; });
    if (!is_known) {
      field.in("anchored", static_cast<std::size_t>(i))
          .refuse("is \"" + side + "\"; it must be one of -x, +x, -y, +y, -z, +z");
    }
  }
}

void complete_color(wire::SoftBody& body, const SceneField& field) {
  if (body.color_rgb().empty()) {
    for (const double part : {0.8, 0.5, 0.5}) body.add_color_rgb(part);
  }
  if (body.color_rgb_size() != 3) {
    field.in("color_rgb").refuse("has " + std::to_string(body.color_rgb_size()) + " numbers; it must have 3");
  }
  for (int i = 0; i < 3; ++i) {
    field.in("color_rgb", static_cast<std::size_t>(i)).require_at_least_zero(body.color_rgb(i), 1);
  }
}

}  // namespace

void complete_soft_bodies(wire::Scene& scene, const SceneField& file) {
  const int count = scene.soft_bodies_size();
  if (count > static_cast<int>(kMaxSoftBodies)) {
    file.in("soft_bodies")
        .refuse("has " + std::to_string(count) + " bodies; at most " + std::to_string(kMaxSoftBodies) +
                " are possible");
  }
  std::set<std::string> names;
  for (int i = 0; i < count; ++i) {
    wire::SoftBody& body = *scene.mutable_soft_bodies(i);
    const SceneField field = file.in("soft_bodies", static_cast<std::size_t>(i));
    check_unique_name(body.name(), names, field.in("name"));
    complete(*body.mutable_placement(), field.in("placement"));
    complete_kind(body, field);
    complete_material(body, field);
    check_anchored(body, field);
    complete_color(body, field);
  }
  if (!scene.has_soft_step_rate_hz()) scene.set_soft_step_rate_hz(60);
  const double most = std::min(1000U, scene.step_rate_hz());
  file.in("soft_step_rate_hz")
      .require_within(scene.soft_step_rate_hz(), 30, most,
                      "from 30 to " + number_text(most) + " (and to step_rate_hz)");
}

}  // namespace tandem::server
