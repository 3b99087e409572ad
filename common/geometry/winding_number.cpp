#include "common/geometry/winding_number.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {

/// Sum of angles between −π and π, each given as a place (x, y) in its direction: as the product of these places as
/// complex numbers, with the turns that it has made, so that one arc tangent serves for all.
struct WindingNumber::AngleSum {
  double x = 1;
  double y = 0;
  int turns = 0;

  void add(double of_x, double of_y) noexcept {
    const double new_x = x * of_x - y * of_y;
    const double new_y = x * of_y + y * of_x + 0.0;  // never −0: straight back is π, not −π
    const double size = std::max(std::abs(new_x), std::abs(new_y));
    if (!(size > 0)) return;  // in a corner of the triangle, or in its edge: any angle would do
    if (y >= 0 && of_y > 0 && new_y < 0) ++turns;
    if (y < 0 && of_y < 0 && new_y >= 0) --turns;
    x = new_x / size;
    y = new_y / size;
  }
  double angle() const noexcept { return std::atan2(y, x) + 2 * std::numbers::pi * turns; }
};

struct WindingNumber::Build {
  std::vector<Vec3> centroids;   ///< of the mesh's triangles
  std::vector<double> areas_m2;  ///< likewise
};

WindingNumber::WindingNumber(const TriangleMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  Build build_of{std::vector<Vec3>(order_.size()), std::vector<double>(order_.size())};
  for (const std::uint32_t t : order_) {
    build_of.centroids[t] = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3;
    build_of.areas_m2[t] = doubled_area(mesh, t).norm() / 2;
  }
  nodes_.reserve(order_.size() / 2 + 1);
  if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()), build_of);
}

void WindingNumber::build(std::uint32_t first, std::uint32_t count, const Build& build_of) {
  const std::vector<Vec3>& centroids = build_of.centroids;
  const std::size_t at = nodes_.size();
  Node node;
  node.first = first;
  node.count = count;
  const auto triangles = std::span(order_).subspan(first, count);
  double weight = 0;
  Vec3 low = centroids[triangles.front()], high = low;
  for (const std::uint32_t t : triangles) {
    node.middle_S += build_of.areas_m2[t] * centroids[t];
    weight += build_of.areas_m2[t];
    low = low.cwiseMin(centroids[t]);
    high = high.cwiseMax(centroids[t]);
  }
  node.middle_S = weight > 0 ? Vec3(node.middle_S / weight) : Vec3((low + high) / 2);
  double squared = 0;
  for (const std::uint32_t t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) squared = std::max(squared, (corner(t, i) - node.middle_S).squaredNorm());
  }
  node.radius_m = std::sqrt(squared);
  nodes_.push_back(node);
  if (count > kLeafTriangles) {
    int axis = 0;
    (high - low).maxCoeff(&axis);
    std::nth_element(triangles.begin(), triangles.begin() + count / 2, triangles.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return centroids[a][axis] < centroids[b][axis]; });
    build(first, count / 2, build_of);
    nodes_[at].second = static_cast<std::uint32_t>(nodes_.size());
    build(first + count / 2, count - count / 2, build_of);
    add_moments(nodes_[at], nodes_[at + 1]);
    add_moments(nodes_[at], nodes_[nodes_[at].second]);
  } else {
    for (const std::uint32_t t : triangles) add_moments(nodes_[at], t);
  }
  nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
}

/// Of a child, whose middle is `e` from the parent's: d there is d + e here.
void WindingNumber::add_moments(Node& node, const Node& child) {
  const Vec3 e = child.middle_S - node.middle_S;
  const Vec3& n = child.area_m2;
  const Eigen::Matrix3d& m = child.first_m3;
  node.area_m2 += n;
  node.first_m3 += m + (n * e.transpose() + e * n.transpose()) / 2;
  node.second_m4 += child.second_m4 + 2 * m.trace() * e + 4 * m * e + 2 * n.dot(e) * e + e.squaredNorm() * n;
  // 2 (e·r) rᵀM r + (N·r) (e·r)².
  const Eigen::Matrix3d q = 2 * m + (n * e.transpose() + e * n.transpose()) / 2;
  auto& cubic = node.second_cubic_m4;
  for (std::size_t i = 0; i < cubic.size(); ++i) cubic[i] += child.second_cubic_m4[i];
  cubic[0] += e.x() * q(0, 0);
  cubic[1] += e.y() * q(1, 1);
  cubic[2] += e.z() * q(2, 2);
  cubic[3] += e.y() * q(0, 0) + 2 * e.x() * q(0, 1);
  cubic[4] += e.z() * q(0, 0) + 2 * e.x() * q(0, 2);
  cubic[5] += e.x() * q(1, 1) + 2 * e.y() * q(0, 1);
  cubic[6] += e.z() * q(1, 1) + 2 * e.y() * q(1, 2);
  cubic[7] += e.x() * q(2, 2) + 2 * e.z() * q(0, 2);
  cubic[8] += e.y() * q(2, 2) + 2 * e.z() * q(1, 2);
  cubic[9] += 2 * (e.x() * q(1, 2) + e.y() * q(0, 2) + e.z() * q(0, 1));
}

/// Of a triangle with corners d₀, d₁, d₂ from the node's middle, exactly: ∫ d dA = A c, ∫ d dᵀ dA = A (Σ dᵢ dᵢᵀ + 9 c cᵀ) / 12.
void WindingNumber::add_moments(Node& node, std::uint32_t triangle) const {
  const Vec3 area = doubled_area(mesh_, triangle) / 2;
  node.area_m2 += area;
  Vec3 centre = Vec3::Zero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 d = corner(triangle, i) - node.middle_S;
    centre += d / 3;
    spread += d * d.transpose() / 12;
  }
  spread += 0.75 * centre * centre.transpose();
  node.first_m3 += (area * centre.transpose() + centre * area.transpose()) / 2;
  node.second_m4 += 2 * spread * area + spread.trace() * area;
  auto& cubic = node.second_cubic_m4;
  cubic[0] += area.x() * spread(0, 0);
  cubic[1] += area.y() * spread(1, 1);
  cubic[2] += area.z() * spread(2, 2);
  cubic[3] += 2 * area.x() * spread(0, 1) + area.y() * spread(0, 0);
  cubic[4] += 2 * area.x() * spread(0, 2) + area.z() * spread(0, 0);
  cubic[5] += 2 * area.y() * spread(0, 1) + area.x() * spread(1, 1);
  cubic[6] += 2 * area.y() * spread(1, 2) + area.z() * spread(1, 1);
  cubic[7] += 2 * area.z() * spread(0, 2) + area.x() * spread(2, 2);
  cubic[8] += 2 * area.z() * spread(1, 2) + area.y() * spread(2, 2);
  cubic[9] += 2 * (area.x() * spread(1, 2) + area.y() * spread(0, 2) + area.z() * spread(0, 1));
}

/// N·r / r³ + tr M / r³ − 3 rᵀM r / r⁵ + ½ (−3 v·r / r⁵ + 15 S(r, r, r) / r⁷).
double WindingNumber::far_angle(const Node& node, const Vec3& r, double squared) noexcept {
  const double x = r.x(), y = r.y(), z = r.z();
  const double per_r2 = 1 / squared;
  const double per_r3 = per_r2 / std::sqrt(squared);
  const auto& s = node.second_cubic_m4;
  const double cubic = x * x * (s[0] * x + s[3] * y + s[4] * z) + y * y * (s[1] * y + s[5] * x + s[6] * z) +
                       z * z * (s[2] * z + s[7] * x + s[8] * y) + s[9] * x * y * z;
  const double first = node.first_m3.trace() - 3 * per_r2 * r.dot(node.first_m3 * r);
  const double second = per_r2 * (-1.5 * node.second_m4.dot(r) + 7.5 * per_r2 * cubic);
  return per_r3 * (node.area_m2.dot(r) + first + second);
}

bool WindingNumber::add_angle(std::uint32_t triangle, const Vec3& p_S, AngleSum& sum) const noexcept {
  const Vec3 a = corner(triangle, 0) - p_S;
  const Vec3 b = corner(triangle, 1) - p_S;
  const Vec3 c = corner(triangle, 2) - p_S;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double all = la * lb * lc;
  const double x = all + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  const double y = a.dot(b.cross(c));
  sum.add(x, y);
  // x is 0 on a side of the triangle and less than 0 within.
  return x <= kOnShare * all && std::abs(y) <= kOnShare * all;
}

double WindingNumber::at(const Vec3& p_S, int without, bool* lies_on) const noexcept {
  double far = 0;
  bool is_on = false;
  AngleSum near;
  for (std::uint32_t i = 0; i < nodes_.size();) {
    const Node& node = nodes_[i];
    const Vec3 to_middle = node.middle_S - p_S;
    const double squared = to_middle.squaredNorm();
    if (squared > kFar * kFar * node.radius_m * node.radius_m) {
      far += far_angle(node, to_middle, squared);
      i = node.next;
    } else if (node.second != 0) {
      ++i;
    } else {
      for (std::uint32_t slot = node.first; slot < node.first + node.count; ++slot) {
        const std::uint32_t triangle = order_[slot];
        if (static_cast<int>(triangle) != without) is_on |= add_angle(triangle, p_S, near);
      }
      i = node.next;
    }
  }
  if (lies_on != nullptr) *lies_on = is_on;
  return (far + 2 * near.angle()) / (4 * std::numbers::pi);
}

}  // namespace tandem::geometry
