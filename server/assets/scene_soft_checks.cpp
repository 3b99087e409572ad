#include "server/assets/scene_soft_checks.hpp"

#include <algorithm>
#include <set>
#include <string>

#include "server/assets/scene_checks.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {
namespace {

Vec3 size_of(const wire::SoftBlock& block) {
  return {block.size_m(0), block.size_m(1), block.size_m(2)};
}

void check(const wire::SoftBlock& block, const SceneField& field) {
  const auto nodes = soft_block_nodes(soft_block_cells(size_of(block), block.spacing_m()));
  if (nodes > kMaxSoftNodes) {
    field.in("spacing_m")
        .refuse("is " + number_text(block.spacing_m()) + ", which makes " + std::to_string(nodes) + " nodes; at most " +
                std::to_string(kMaxSoftNodes) + " are possible: widen it");
  }
}

void check_kind(const wire::SoftBody& body, const SceneField& field) {
  switch (body.kind_case()) {
    case wire::SoftBody::kBlock:
      return check(body.block(), field.in("block"));
    case wire::SoftBody::kMesh:
      return check_mesh(body.mesh(), field.in("mesh"));
    case wire::SoftBody::KIND_NOT_SET:
      break;
  }
  field.refuse("has no kind; it must have one of block, mesh");
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

}  // namespace

void complete_soft_bodies(wire::Scene& scene) {
  for (wire::SoftBody& body : *scene.mutable_soft_bodies()) {
    body.mutable_placement();
    if (body.has_mesh()) complete_mesh(*body.mutable_mesh());
    if (!body.has_block() || body.block().has_spacing_m() || body.block().size_m_size() != 3) continue;
    body.mutable_block()->set_spacing_m(size_of(body.block()).maxCoeff() / 8);
  }
}

void check_soft_bodies(const wire::Scene& scene, const SceneField& file) {
  const int count = scene.soft_bodies_size();
  if (count > static_cast<int>(kMaxSoftBodies)) {
    file.in("soft_bodies")
        .refuse("has " + std::to_string(count) + " bodies; at most " + std::to_string(kMaxSoftBodies) +
                " are possible");
  }
  std::set<std::string> names;
  for (int i = 0; i < count; ++i) {
    const wire::SoftBody& body = scene.soft_bodies(i);
    const SceneField field = file.in("soft_bodies", static_cast<std::size_t>(i));
    check_unique_name(body.name(), names, field.in("name"));
    check_kind(body, field);
    check_anchored(body, field);
  }
  const double highest_hz = scene.step_rate_hz();
  file.in("soft_step_rate_hz")
      .require_within(scene.soft_step_rate_hz(), 0, highest_hz, "at most step_rate_hz, " + number_text(highest_hz));
}

}  // namespace tandem::server
