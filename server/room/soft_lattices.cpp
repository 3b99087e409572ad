// See soft_lattices.hpp.
#include "server/room/soft_lattices.hpp"

namespace tandem::server {

SoftLattices::SoftLattices(const std::vector<SoftModel>& bodies) {
  for (const SoftModel& body : bodies) {
    rest_W_.push_back(body.nodes_W);
    std::vector<Vec3> nodes;
    for (const Vec3& node_W : body.nodes_W) nodes.push_back(body.traits.X_WS.inverse() * node_W);
    points_.push_back(proto::soft_lattice_nodes(nodes));
  }
}

std::vector<std::vector<Vec3>> SoftLattices::at_rest() const {
  std::vector<std::vector<Vec3>> offsets;
  for (const std::vector<proto::NearPlaces>& points : points_) offsets.emplace_back(points.size(), Vec3(0, 0, 0));
  return offsets;
}

void SoftLattices::measure(const physics::World& world, std::vector<std::vector<Vec3>>& out) const noexcept {
  for (std::size_t body = 0; body < points_.size(); ++body) {
    const std::span<const Vec3> now_W = world.soft_nodes_W(body);
    const std::vector<Vec3>& rest_W = rest_W_[body];
    if (now_W.size() != rest_W.size()) continue;
    for (std::size_t i = 0; i < points_[body].size(); ++i) {
      Vec3 offset = Vec3::Zero();
      for (const auto& [node, weight] : points_[body][i]) offset += weight * (now_W[node] - rest_W[node]);
      out[body][i] = offset;
    }
  }
}

}  // namespace tandem::server
