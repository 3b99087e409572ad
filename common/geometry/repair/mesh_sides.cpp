#include "common/geometry/repair/mesh_sides.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <thread>
#include <utility>

#include "common/base/parallel_for.hpp"
#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {
namespace {

// Numbers of rays that are tested to find openings: minimum and maximum for one part, and maximum for all open parts
// together.
constexpr std::size_t kMinRaysOfPart = 8, kMaxRaysOfPart = 256, kMaxRays = 2000;
// Meshes with fewer triangles than this are classified on one thread.
constexpr std::size_t kMinForThreads = 5000;
constexpr std::size_t kMaxThreads = 16;

// Distance of sample points from both sides of a triangle, as a fraction of the mesh's diagonal. It is 20 times the gap
// that single precision leaves between coplanar triangles, and a tenth of the thickness of a thin wall.
constexpr double kStepShare = 2e-6;

// Tolerance of a clear classification: largest deviation of the winding number from the exact value of a border, the
// inside or the outside.
constexpr double kUnclear = 0.1;

/// Classifies a triangle by the mean of the winding numbers on its two sides. The triangle itself makes the winding
/// number jump by 1, so the mean is the winding number of all other triangles there:
/// * border of a solid: ½ (−½ if the solid is inside out)
/// * outside: 0
/// * inside: 1 or more
/// If the jump is 2, the solid or the triangle exists twice. The mean for a border is then 1 or ½.
Side side_of(double half_way, double jump = 1) {
  const double others = std::abs(half_way);
  if (others < 0.25) return Side::kOutside;
  return others < std::max(1.0, std::abs(jump)) / 2 + 0.25 ? Side::kBorder : Side::kInside;
}

/// Returns whether a mean winding number is close to the value of a border, the inside or the outside. It may be
/// between these values near a wall of which one side has no faces.
bool is_clear(double half_way) {
  const double others = std::abs(half_way);
  return others > 1 - kUnclear || others < kUnclear || std::abs(others - 0.5) < kUnclear;
}

/// Classifies each triangle by the winding number of all other triangles at its middle. If another triangle contains
/// this point, the result would depend on rounding. The winding numbers at a small distance on both sides are then used
/// instead.
class SideClassifier {
 public:
  explicit SideClassifier(const TriangleMesh& mesh)
      : mesh_(mesh), winding_(mesh), step_m_(kStepShare * diagonal_m(mesh)) {}

  /// Out     is_sure  false if the classification is not clear, see is_clear()
  Side side_of(std::size_t triangle, bool& is_sure) const {
    const std::array<Vec3, 3> corners = corners_of(mesh_, triangle);
    const Vec3 normal = doubled_area(mesh_, triangle).stableNormalized();
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
    bool lies_on_another = false;
    const double half_way = winding_.at(middle, static_cast<int>(triangle), &lies_on_another);
    is_sure = lies_on_another || is_clear(half_way);
    if (!lies_on_another) {
      const Side side = tandem::geometry::side_of(half_way);
      return side == Side::kInside && comes_out(triangle, corners) ? Side::kBorder : side;
    }
    const Side side = side_beside(middle, normal);
    if (side == Side::kBorder) return side;
    // The coincident triangle may cover only a part of this one, so several points are sampled. The triangle becomes a
    // border if any sample is one. This is the safer error: a missing border triangle would leave a hole, but a
    // superfluous one is inside and cannot be felt.
    for (const Vec3& corner : corners) {
      if (side_beside((middle + corner) / 2, normal) == Side::kBorder) return Side::kBorder;
    }
    return side;
  }

 private:
  static double diagonal_m(const TriangleMesh& mesh) {
    Vec3 low = mesh.vertices.front();
    Vec3 high = low;
    for (const Vec3& p : mesh.vertices) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    return (high - low).norm();
  }

  /// Returns whether a triangle whose middle is inside extends to the border of the solid, because another closed part
  /// crosses it. Samples the middles of sixteen equal subtriangles. The test is not reliable near an open surface,
  /// where the winding number can have any value.
  bool comes_out(std::size_t triangle, const std::array<Vec3, 3>& corners) const {
    constexpr int kAlong = 4;
    const Vec3 u = (corners[1] - corners[0]) / kAlong, v = (corners[2] - corners[0]) / kAlong;
    const auto is_border = [&](double along_u, double along_v) {
      const Vec3 p = corners[0] + along_u * u + along_v * v;
      return std::abs(std::abs(winding_.at(p, static_cast<int>(triangle))) - 0.5) < kUnclear;
    };
    for (int i = 0; i < kAlong; ++i) {
      for (int k = 0; i + k < kAlong; ++k) {
        const bool has_other = i + k + 1 < kAlong;
        if (is_border(i + 1.0 / 3, k + 1.0 / 3) || (has_other && is_border(i + 2.0 / 3, k + 2.0 / 3))) return true;
      }
    }
    return false;
  }

  Side side_beside(const Vec3& p, const Vec3& normal) const {
    const double behind = winding_.at(p - step_m_ * normal);
    const double before = winding_.at(p + step_m_ * normal);
    return tandem::geometry::side_of((behind + before) / 2, behind - before);
  }

  const TriangleMesh& mesh_;
  WindingNumber winding_;
  double step_m_;
};

/// Classifies some triangles of a mesh. Returns for each of them whether the result is certain.
std::vector<char> classify(const TriangleMesh& mesh, const std::vector<std::size_t>& triangles,
                           std::vector<Side>& sides) {
  const SideClassifier classifier(mesh);
  std::vector<char> is_sure(triangles.size());
  const std::size_t processors = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t threads = sides.size() < kMinForThreads ? 1 : std::min(processors, kMaxThreads);
  parallel_for(static_cast<int>(threads), sides.size(), [&](std::size_t i) {
    bool sure = true;
    sides[i] = classifier.side_of(triangles[i], sure);
    is_sure[i] = sure ? 1 : 0;
  });
  return is_sure;
}

/// Tests rays that start at a surface in the directions of its normals, to find openings of enclosures.
class Rays {
 public:
  explicit Rays(const TriangleMesh& all) : winding_(all), tree_(all) {
    Eigen::AlignedBox3d box;
    for (const Vec3& vertex : all.vertices) box.extend(vertex);
    farthest_m_ = box.sizes().norm();
  }

  /// Returns whether a straight ray from the middle of a triangle leads out of the inside before it meets a triangle.
  bool get_out(const Vec3& middle, const Vec3& normal) const {
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 ahead = sign * normal;
      const double way_m = free_way_m(middle, ahead);
      if (!is_inside(middle + kNear * way_m * ahead)) continue;
      for (const double share : kPlaces) {
        if (!is_inside(middle + share * way_m * ahead)) return true;
      }
    }
    return false;
  }

 private:
  static constexpr double kNear = 0.02;
  static constexpr std::array kPlaces{0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 0.98};
  static constexpr std::size_t kMaxCrossed = 64;
  /// Hits that are closer than this fraction of the mesh's size are ignored, because they are on the triangle itself.
  static constexpr double kItself = 1e-6;

  bool is_inside(const Vec3& p) const { return std::abs(winding_.at(p)) > 0.5; }

  double free_way_m(const Vec3& from, const Vec3& ahead) const {
    std::array<TriangleTree::Near, kMaxCrossed> crossed;
    const std::size_t count = std::min(crossed.size(), tree_.crossed(from, ahead, crossed));
    double way_m = farthest_m_;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 normal = crossed[i].ab.cross(crossed[i].ac);
      const double at_m = normal.dot(crossed[i].a - from) / normal.dot(ahead);
      if (at_m > kItself * farthest_m_) way_m = std::min(way_m, at_m);
    }
    return way_m;
  }

  WindingNumber winding_;
  TriangleTree tree_;
  double farthest_m_ = 0;
};

}  // namespace

std::vector<Side> sides_of(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return {};
  std::vector<Side> sides(mesh.triangles.size());
  std::vector<std::size_t> all(sides.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<char> is_sure = classify(mesh, all, sides);
  // In the second pass, uncertain triangles are classified again, in a mesh without the triangles that are certainly
  // inside or outside.
  TriangleMesh rest{mesh.vertices, {}};
  std::vector<std::size_t> unsure, unsure_in_rest;
  for (const std::size_t t : all) {
    if (is_sure[t] != 0 && sides[t] != Side::kBorder) continue;
    if (is_sure[t] == 0) {
      unsure.push_back(t);
      unsure_in_rest.push_back(rest.triangles.size());
    }
    rest.triangles.push_back(mesh.triangles[t]);
  }
  if (unsure.empty() || rest.triangles.size() == all.size()) return sides;
  std::vector<Side> again(unsure.size());
  classify(rest, unsure_in_rest, again);
  for (std::size_t i = 0; i < unsure.size(); ++i) sides[unsure[i]] = again[i];
  return sides;
}

std::vector<int> those_of(const std::vector<Side>& sides, Side side) {
  std::vector<int> triangles;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (sides[i] == side) triangles.push_back(static_cast<int>(i));
  }
  return triangles;
}

std::vector<int> inner_of(const std::vector<MeshPart>& parts, const std::vector<Side>& sides) {
  std::vector<int> inner;
  std::size_t first = 0;
  for (const MeshPart& part : parts) {
    const auto of_part =
        std::span(sides).subspan(std::exchange(first, first + part.triangles.size()), part.triangles.size());
    if (std::ranges::find(of_part, Side::kBorder) == of_part.end()) continue;
    for (std::size_t i = 0; i < of_part.size(); ++i) {
      if (of_part[i] == Side::kInside) inner.push_back(static_cast<int>(first - of_part.size() + i));
    }
  }
  return inner;
}

std::vector<double> open_shares(const TriangleMesh& surface, const std::vector<MeshPart>& parts,
                                const TriangleMesh& all) {
  const Rays rays(all);
  const std::size_t open = parts.size() - static_cast<std::size_t>(std::ranges::count_if(parts, is_closed));
  const std::size_t most = std::clamp(kMaxRays / std::max<std::size_t>(1, open), kMinRaysOfPart, kMaxRaysOfPart);
  std::vector<double> shares;
  for (const MeshPart& part : parts) {
    shares.push_back(0);
    if (is_closed(part)) continue;
    std::vector<double> area_up_to_m2;
    for (const int t : part.triangles) {
      area_up_to_m2.push_back((area_up_to_m2.empty() ? 0 : area_up_to_m2.back()) +
                              doubled_area(surface, static_cast<std::size_t>(t)).norm() / 2);
    }
    for (std::size_t k = 0; k < most; ++k) {
      const double at_m2 = (static_cast<double>(k) + 0.5) / static_cast<double>(most) * area_up_to_m2.back();
      const auto chosen = std::ranges::lower_bound(area_up_to_m2, at_m2) - area_up_to_m2.begin();
      const auto t = static_cast<std::size_t>(part.triangles[static_cast<std::size_t>(chosen)]);
      const auto [a, b, c] = corners_of(surface, t);
      // A triangle that is sampled more than once gets a different point each time.
      const double u = std::fmod(0.5 + 0.618 * static_cast<double>(k), 1),
                   v = std::fmod(0.5 + 0.755 * static_cast<double>(k), 1);
      const Vec3 p = a + (u + v > 1 ? 1 - u : u) * (b - a) + (u + v > 1 ? 1 - v : v) * (c - a);
      const Vec3 normal = doubled_area(surface, t).stableNormalized();
      if (!normal.isZero() && rays.get_out(p, normal)) shares.back() += 1.0 / static_cast<double>(most);
    }
  }
  return shares;
}

}  // namespace tandem::geometry
