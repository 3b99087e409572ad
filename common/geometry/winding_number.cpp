#include "common/geometry/winding_number.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {
namespace {

/// Triangles are divided into pieces whose sides are below a maximum length, which is found by trial. The search starts
/// at the longest side of the mesh and multiplies the length by kShorter, as long as the number of pieces is permitted.
/// It ends at the larger of two lengths: kShortest times the longest side, and kLong times the median width of the
/// triangles.
constexpr double kShortest = 1.0 / 64, kShorter = 0.8, kLong = 3;
/// Maximum number of halvings of a triangle. Fewer suffice for sides of the length kShortest. The limit is needed if
/// the ends of a side are adjacent doubles: the middle of the side then equals one end, and halving would never end.
constexpr int kMaxHalvings = 24;

Vec3 centroid(const std::array<Vec3, 3>& corners) {
  return (corners[0] + corners[1] + corners[2]) / 3;
}

Vec3 area_normal(const std::array<Vec3, 3>& corners) {
  return (corners[1] - corners[0]).cross(corners[2] - corners[0]) / 2;
}

struct LongSide {
  std::size_t from;
  double length_m;
};

LongSide longest_side(const std::array<Vec3, 3>& corners) {
  LongSide longest{0, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    const double length_m = (corners[(i + 1) % 3] - corners[i]).norm();
    if (length_m > longest.length_m) longest = {i, length_m};
  }
  return longest;
}

/// Halves the longest side repeatedly until no side is longer than `side_m`; calls `visit` for each piece.
template <class Visit>
void divide(const std::array<Vec3, 3>& corners, double side_m, const Visit& visit, int halvings = 0) {
  const LongSide side = longest_side(corners);
  if (!(side.length_m > side_m) || halvings == kMaxHalvings) {
    visit(corners);
    return;
  }
  const std::size_t to = (side.from + 1) % 3;
  std::array<Vec3, 3> half = corners;
  half[to] = (corners[side.from] + corners[to]) / 2;
  divide(half, side_m, visit, halvings + 1);
  std::array<Vec3, 3> other = corners;
  other[side.from] = half[to];
  divide(other, side_m, visit, halvings + 1);
}

}  // namespace

/// Node with the pieces first … first + count − 1. Its children are the next node in the array and the node `second`.
/// It stores integrals over the surface of its pieces. In these, n is the unit normal, dA the area element, and d the
/// vector from middle_S to the area element. far_angle() uses them for a query point at a distance; r is the vector
/// from that point to middle_S.
struct WindingNumber::Node {
  Vec3 middle_S = Vec3::Zero();
  Vec3 area_m2 = Vec3::Zero();                         ///< N = ∫ n dA
  Eigen::Matrix3d first_m3 = Eigen::Matrix3d::Zero();  ///< M, the symmetric part of ∫ n dᵀ dA
  Vec3 second_m4 = Vec3::Zero();                       ///< v = ∫ (2 (n·d) d + |d|² n) dA
  /// Coefficients of x³, y³, z³, x²y, x²z, y²x, y²z, z²x, z²y and xyz in S(r, r, r) = ∫ (n·r) (d·r)² dA, where
  /// r = (x, y, z).
  std::array<double, 10> second_cubic_m4 = {};
  double radius_m = 0;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  std::uint32_t second = 0;  ///< index of the second child; 0: the node is a leaf
  std::uint32_t next = 0;    ///< index of the next node after this subtree
};

/// Sum of angles between −π and π. Each angle is given by a point (x, y) in its direction. The points are multiplied as
/// complex numbers, and full turns are counted. Thus, the whole sum needs only one arc tangent.
struct WindingNumber::AngleSum {
  double x = 1;
  double y = 0;
  int turns = 0;

  void add(double of_x, double of_y) noexcept {
    const double new_x = x * of_x - y * of_y;
    const double new_y = x * of_y + y * of_x + 0.0;  // never −0, so that the opposite direction gives π and not −π
    const double size = std::max(std::abs(new_x), std::abs(new_y));
    if (!(size > 0)) return;  // p is on a corner or an edge of the triangle, where any angle is correct
    if (y >= 0 && of_y > 0 && new_y < 0) ++turns;
    if (y < 0 && of_y < 0 && new_y >= 0) --turns;
    x = new_x / size;
    y = new_y / size;
  }
  double angle() const noexcept { return std::atan2(y, x) + 2 * std::numbers::pi * turns; }
};

WindingNumber::WindingNumber(WindingNumber&& other) noexcept = default;
WindingNumber& WindingNumber::operator=(WindingNumber&& other) noexcept = default;
WindingNumber::~WindingNumber() = default;

WindingNumber::WindingNumber(const TriangleMesh& mesh) {
  const std::size_t triangles = mesh.triangles.size();
  double longest_m = 0;
  std::vector<double> widths_m(triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    const auto corners = corners_of(mesh, t);
    longest_m = std::max(longest_m, longest_side(corners).length_m);
    widths_m[t] = std::sqrt(2 * area_normal(corners).norm());
  }
  double shortest_m = kShortest * longest_m;
  if (!widths_m.empty()) {
    const auto median = widths_m.begin() + static_cast<std::ptrdiff_t>(triangles / 2);
    std::ranges::nth_element(widths_m, median);
    shortest_m = std::max(shortest_m, kLong * *median);
  }
  const std::size_t most = triangles < kMinToDivide ? 0 : kPieces * triangles;
  double side_m = longest_m;
  std::size_t pieces = triangles;
  for (double shorter_m = side_m; shorter_m > shortest_m; shorter_m *= kShorter) {
    std::size_t count = 0;
    for (std::size_t t = 0; t < triangles && count <= most; ++t)
      divide(corners_of(mesh, t), shorter_m, [&count](const std::array<Vec3, 3>&) { ++count; });
    if (count > most) break;
    side_m = shorter_m;
    pieces = count;
  }
  pieces_.reserve(pieces);
  for (std::size_t t = 0; t < triangles; ++t) {
    divide(corners_of(mesh, t), side_m,
           [&](const std::array<Vec3, 3>& corners) { pieces_.emplace_back(corners, static_cast<std::uint32_t>(t)); });
  }
  nodes_.reserve(pieces_.size() / 2 + 1);
  if (!pieces_.empty()) build(0, static_cast<std::uint32_t>(pieces_.size()));
}

void WindingNumber::build(std::uint32_t first, std::uint32_t count) {
  const std::size_t at = nodes_.size();
  Node node;
  node.first = first;
  node.count = count;
  const auto pieces = std::span(pieces_).subspan(first, count);
  double weight = 0;
  Vec3 low = centroid(pieces.front().first), high = low;
  for (const auto& [corners, triangle] : pieces) {
    const double area = area_normal(corners).norm();
    const Vec3 centre = centroid(corners);
    node.middle_S += area * centre;
    weight += area;
    low = low.cwiseMin(centre);
    high = high.cwiseMax(centre);
  }
  node.middle_S = weight > 0 ? Vec3(node.middle_S / weight) : Vec3((low + high) / 2);
  double squared = 0;
  for (const auto& [corners, triangle] : pieces) {
    for (const Vec3& corner : corners) squared = std::max(squared, (corner - node.middle_S).squaredNorm());
  }
  node.radius_m = std::sqrt(squared);
  nodes_.push_back(node);
  if (count > kLeafPieces) {
    int axis = 0;
    (high - low).maxCoeff(&axis);
    std::nth_element(pieces.begin(), pieces.begin() + count / 2, pieces.end(), [axis](const Piece& a, const Piece& b) {
      return centroid(a.first)[axis] < centroid(b.first)[axis];
    });
    build(first, count / 2);
    nodes_[at].second = static_cast<std::uint32_t>(nodes_.size());
    build(first + count / 2, count - count / 2);
    add_moments(nodes_[at], nodes_[at + 1]);
    add_moments(nodes_[at], nodes_[nodes_[at].second]);
  } else {
    for (const Piece& piece : pieces) add_moments(nodes_[at], piece);
  }
  nodes_[at].next = static_cast<std::uint32_t>(nodes_.size());
}

/// Adds the moments of a child. The child's middle is at `e` relative to the parent's middle, so a vector d from the
/// child's middle is d + e from the parent's.
void WindingNumber::add_moments(Node& node, const Node& child) {
  const Vec3 e = child.middle_S - node.middle_S;
  const Vec3& n = child.area_m2;
  const Eigen::Matrix3d& m = child.first_m3;
  node.area_m2 += n;
  node.first_m3 += m + (n * e.transpose() + e * n.transpose()) / 2;
  node.second_m4 += child.second_m4 + 2 * m.trace() * e + 4 * m * e + 2 * n.dot(e) * e + e.squaredNorm() * n;
  // Cubic form of the child relative to the parent's middle: 2 (e·r) rᵀM r + (N·r) (e·r)².
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

/// Adds the exact moments of a triangle of area A with the centroid c. With its corners d₀, d₁, d₂, all relative to the
/// node's middle: ∫ d dA = A c and ∫ d dᵀ dA = A (Σ dᵢ dᵢᵀ + 9 c cᵀ) / 12.
void WindingNumber::add_moments(Node& node, const Piece& piece) {
  const Vec3 area = area_normal(piece.first);
  node.area_m2 += area;
  Vec3 centre = Vec3::Zero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& corner : piece.first) {
    const Vec3 d = corner - node.middle_S;
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

/// Evaluates the series of the solid angle up to second order in d, with the moments N, M, v and S of Node (r: length
/// of r):
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

bool WindingNumber::add_angle(const std::array<Vec3, 3>& corners, const Vec3& p_S, AngleSum& sum) noexcept {
  const Vec3 a = corners[0] - p_S;
  const Vec3 b = corners[1] - p_S;
  const Vec3 c = corners[2] - p_S;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double all = la * lb * lc;
  const double x = all + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  const double y = a.dot(b.cross(c));
  sum.add(x, y);
  // The sign of x shows whether p is on the triangle, in whose plane y is 0. x is 0 on a side and negative in the
  // interior. Both tests have a tolerance.
  return x <= kOnShare * all && std::abs(y) <= kOnShare * all;
}

double WindingNumber::at(const Vec3& p_S, int excluded_triangle, bool* lies_on) const noexcept {
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
      for (const auto& [corners, triangle] : std::span(pieces_).subspan(node.first, node.count)) {
        if (static_cast<int>(triangle) != excluded_triangle) is_on |= add_angle(corners, p_S, near);
      }
      i = node.next;
    }
  }
  if (lies_on != nullptr) *lies_on = is_on;
  return (far + 2 * near.angle()) / (4 * std::numbers::pi);
}

}  // namespace tandem::geometry
