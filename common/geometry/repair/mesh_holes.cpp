#include "common/geometry/repair/mesh_holes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/geometry/repair/mesh_weld.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {
namespace {

// Longer loops are closed from their middle: clipping takes the square of their length.
constexpr std::size_t kMaxClipped = 1000;
// Around an edge: so far from it, as a share of the largest side of all, so many places. What is half as far across is closed.
constexpr double kAround = 1e-3;
constexpr int kPlaces = 8;
// In the open, at half of them the winding number is no nearer to a whole one than this; the others may shift it.
constexpr double kBetween = 0.25;
constexpr int kMinBetween = 3;

class HoleCloser {
 public:
  HoleCloser(TriangleMesh& mesh, MeshPart& part) : mesh_(mesh), part_(part) {}

  void close(std::vector<int> loop) {
    // The new triangles run against those at the border.
    std::reverse(loop.begin(), loop.end());
    if (loop.size() <= kMaxClipped) {
      clip(loop);
    } else {
      close_from_middle(loop);
    }
  }

 private:
  const Vec3& at(int vertex) const { return mesh_.vertices[static_cast<std::size_t>(vertex)]; }

  void add(int a, int b, int c) {
    part_.triangles.push_back(static_cast<int>(mesh_.triangles.size()));
    mesh_.triangles.push_back({a, b, c});
  }

  /// Cuts off the corner with the smallest angle until three are left; corners that point inward come last.
  void clip(std::vector<int>& loop) {
    Vec3 facing = Vec3::Zero();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      facing += (at(loop[i]) - at(loop[0])).cross(at(loop[(i + 1) % loop.size()]) - at(loop[0]));
    }
    std::vector<double> angles;
    for (std::size_t i = 0; i < loop.size(); ++i) angles.push_back(angle_at(loop, i, facing));
    while (loop.size() > 3) {
      const auto best = static_cast<std::size_t>(std::min_element(angles.begin(), angles.end()) - angles.begin());
      const std::size_t n = loop.size();
      add(loop[(best + n - 1) % n], loop[best], loop[(best + 1) % n]);
      loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(best));
      angles.erase(angles.begin() + static_cast<std::ptrdiff_t>(best));
      // Only the corners beside it have changed.
      const std::size_t after = best % loop.size();
      const std::size_t before = (best + loop.size() - 1) % loop.size();
      for (const std::size_t i : {before, after}) angles[i] = angle_at(loop, i, facing);
    }
    if (loop.size() == 3) add(loop[0], loop[1], loop[2]);
  }

  double angle_at(const std::vector<int>& loop, std::size_t i, const Vec3& facing) const {
    const std::size_t n = loop.size();
    const Vec3 back = at(loop[(i + n - 1) % n]) - at(loop[i]);
    const Vec3 ahead = at(loop[(i + 1) % n]) - at(loop[i]);
    const Vec3 turn = ahead.cross(back);
    const double angle = std::atan2(turn.norm(), ahead.dot(back));
    return turn.dot(facing) < 0 ? 2 * std::numbers::pi - angle : angle;
  }

  void close_from_middle(const std::vector<int>& loop) {
    Vec3 middle = Vec3::Zero();
    for (const int vertex : loop) middle += at(vertex);
    const auto index = static_cast<int>(mesh_.vertices.size());
    mesh_.vertices.push_back(middle / static_cast<double>(loop.size()));
    for (std::size_t i = 0; i < loop.size(); ++i) add(loop[i], loop[(i + 1) % loop.size()], index);
  }

  TriangleMesh& mesh_;
  MeshPart& part_;
};

/// What is around an edge, of all that there is.
class Surroundings {
 public:
  explicit Surroundings(const TriangleMesh& all) : winding_(all), tree_(all), touching_m_(weld_tolerance_m(all)) {
    Eigen::AlignedBox3d box;
    for (const Vec3& vertex : all.vertices) box.extend(vertex);
    around_m_ = kAround * box.sizes().maxCoeff();
  }

  bool is_open(const Vec3& begin, const Vec3& end) const {
    const Vec3 middle = (begin + end) / 2, along = end - begin;
    const Vec3 across = around_m_ * along.unitOrthogonal(), up = along.normalized().cross(across);
    int between = 0;
    for (int k = 0; k < kPlaces; ++k) {
      const double angle = (k + 0.5) * 2 * std::numbers::pi / kPlaces;
      const double number = winding_.at(middle + std::cos(angle) * across + std::sin(angle) * up);
      between += std::abs(number - std::round(number)) > kBetween ? 1 : 0;
    }
    return between >= kMinBetween && !lies_on_another(begin, end);
  }

 private:
  static constexpr std::size_t kMaxTouching = 8;
  static constexpr double kAside = 0.1;

  /// With a surface that goes on on both sides of it: what lies on a face ends there, and is no mouth.
  bool lies_on_another(const Vec3& begin, const Vec3& end) const {
    std::array<TriangleTree::Near, kMaxTouching> found, beside;
    const Vec3 middle = (begin + end) / 2;
    const std::size_t count = std::min(found.size(), tree_.within(middle, touching_m_, found));
    return std::any_of(found.begin(), found.begin() + count, [&](const TriangleTree::Near& near) {
      const Vec3 across = (end - begin).cross(near.ab.cross(near.ac));
      const double aside_m = std::min(around_m_, (end - begin).norm()) * kAside;
      if (!(across.norm() > 0)) return false;
      const auto is_on_surface = [&](const Vec3& p) { return tree_.within(p, touching_m_, beside) > 0; };
      const Vec3 aside = aside_m * across.normalized();
      return is_on_surface(middle + aside) && is_on_surface(middle - aside);
    });
  }

  WindingNumber winding_;
  TriangleTree tree_;
  double touching_m_;
  double around_m_ = 0;
};

}  // namespace

void close_hole(TriangleMesh& mesh, MeshPart& part, const std::vector<int>& loop) {
  HoleCloser(mesh, part).close(loop);
}

std::vector<std::pair<Vec3, double>> open_edges(const TriangleMesh& mesh, const std::vector<MeshPart>& parts,
                                                const TriangleMesh& all) {
  std::vector<std::pair<Vec3, double>> edges;
  std::optional<Surroundings> surroundings;
  for (const MeshPart& part : parts) {
    for (const auto& loop : part.borders) {
      for (std::size_t i = 0; i < loop.size(); ++i) {
        const Vec3& begin = mesh.vertices[static_cast<std::size_t>(loop[i])];
        const Vec3& end = mesh.vertices[static_cast<std::size_t>(loop[(i + 1) % loop.size()])];
        const double length_m = (end - begin).norm();
        if (!(length_m > 0)) continue;
        if (!surroundings) surroundings.emplace(all);
        if (surroundings->is_open(begin, end)) edges.emplace_back((begin + end) / 2, length_m);
      }
    }
  }
  return edges;
}

}  // namespace tandem::geometry
