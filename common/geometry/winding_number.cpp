#include "common/geometry/winding_number.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {

WindingNumber::WindingNumber(const TriangleMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  std::vector<Vec3> centroids(order_.size());
  for (const std::uint32_t t : order_) centroids[t] = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3;
  nodes_.reserve(order_.size() / 2 + 1);
  if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()), centroids);
}

void WindingNumber::build(std::uint32_t first, std::uint32_t count, const std::vector<Vec3>& centroids) {
  const std::size_t at = nodes_.size();
  Node node;
  node.first = first;
  node.count = count;
  const auto triangles = std::span(order_).subspan(first, count);
  double weight = 0;
  Vec3 low = centroids[triangles.front()], high = low;
  for (const std::uint32_t t : triangles) {
    const Vec3 area = doubled_area(mesh_, t) / 2;
    node.area_m2 += area;
    node.middle_S += area.norm() * centroids[t];
    weight += area.norm();
    low = low.cwiseMin(centroids[t]);
    high = high.cwiseMax(centroids[t]);
  }
  node.middle_S = weight > 0 ? Vec3(node.middle_S / weight) : Vec3((low + high) / 2);
  for (const std::uint32_t t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      node.radius_m = std::max(node.radius_m, (corner(t, i) - node.middle_S).norm());
    }
  }
  nodes_.push_back(node);
  if (count > kLeafTriangles) {
    int axis = 0;
    (high - low).maxCoeff(&axis);
    std::nth_element(triangles.begin(), triangles.begin() + count / 2, triangles.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return centroids[a][axis] < centroids[b][axis]; });
    build(first, count / 2, centroids);
    nodes_[at].second = static_cast<std::uint32_t>(nodes_.size());
    build(first + count / 2, count - count / 2, centroids);
  }
  nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
}

double WindingNumber::solid_angle(std::uint32_t triangle, const Vec3& p_S) const noexcept {
  const Vec3 a = corner(triangle, 0) - p_S;
  const Vec3 b = corner(triangle, 1) - p_S;
  const Vec3 c = corner(triangle, 2) - p_S;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double along = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  return 2 * std::atan2(a.dot(b.cross(c)), along);
}

double WindingNumber::at(const Vec3& p_S, int without) const noexcept {
  double sum = 0;
  for (std::uint32_t i = 0; i < nodes_.size();) {
    const Node& node = nodes_[i];
    const Vec3 to_middle = node.middle_S - p_S;
    const double distance = to_middle.norm();
    if (distance > kFar * node.radius_m) {
      sum += node.area_m2.dot(to_middle) / (distance * distance * distance);
      i = node.next;
    } else if (node.second != 0) {
      ++i;
    } else {
      for (std::uint32_t slot = node.first; slot < node.first + node.count; ++slot) {
        const std::uint32_t triangle = order_[slot];
        if (static_cast<int>(triangle) != without) sum += solid_angle(triangle, p_S);
      }
      i = node.next;
    }
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace tandem::geometry
