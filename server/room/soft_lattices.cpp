// See soft_lattices.hpp.
#include "server/room/soft_lattices.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "proto/soft_shape.hpp"

namespace tandem::server {

SoftLattices::SoftLattices(const std::vector<SoftModel>& bodies) {
  for (const SoftModel& body : bodies) {
    rest_W_.push_back(body.nodes_W);
    Eigen::AlignedBox3d box;
    for (const Vec3& node_W : body.nodes_W) box.extend(body.traits.X_WS.inverse() * node_W);
    std::vector<Point>& points = points_.emplace_back();
    for (const Vec3& share : proto::soft_lattice()) {
      const Vec3 at_S = box.center() + share.cwiseProduct(box.sizes());
      points.push_back(point_at(body.traits.X_WS * at_S, body.nodes_W));
    }
  }
}

SoftLattices::Point SoftLattices::point_at(const Vec3& at_W, const std::vector<Vec3>& nodes_W) {
  std::vector<std::size_t> order(nodes_W.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t near = std::min(kNear, order.size());
  const auto is_nearer = [&](std::size_t a, std::size_t b) {
    return (nodes_W[a] - at_W).squaredNorm() < (nodes_W[b] - at_W).squaredNorm();
  };
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(near), order.end(), is_nearer);
  Point point{};
  double sum = 0;
  for (std::size_t i = 0; i < near; ++i) {
    point[i] = {order[i], 1 / std::max((nodes_W[order[i]] - at_W).norm(), 1e-9)};
    sum += point[i].second;
  }
  for (auto& [node, weight] : point) weight /= sum;
  return point;
}

std::vector<std::vector<Vec3>> SoftLattices::at_rest() const {
  std::vector<std::vector<Vec3>> offsets;
  for (const std::vector<Point>& points : points_) offsets.emplace_back(points.size(), Vec3(0, 0, 0));
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
