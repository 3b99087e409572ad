#include "common/geometry/repair/mesh_holes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::geometry {
namespace {

// Maximum number of edges of a loop that is closed by ear clipping, whose cost is quadratic. A longer loop is closed by
// a fan of triangles around the loop's centre.
constexpr std::size_t kMaxClipped = 1000;

class HoleCloser {
 public:
  HoleCloser(TriangleMesh& mesh, MeshPart& part) : mesh_(mesh), part_(part) {}

  void close(std::vector<int> loop) {
    // The new triangles must traverse the border in the opposite direction.
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

  /// Ear clipping: repeatedly cuts off the corner with the smallest angle until three corners are left. Reflex corners
  /// have larger angles and are therefore cut off last.
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
      // The cut changes the angles of the two neighbouring corners only.
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

}  // namespace

void close_hole(TriangleMesh& mesh, MeshPart& part, const std::vector<int>& loop) {
  HoleCloser(mesh, part).close(loop);
}

}  // namespace tandem::geometry
