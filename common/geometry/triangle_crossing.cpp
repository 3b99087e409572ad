#include "common/geometry/triangle_crossing.hpp"

#include <algorithm>

#include "common/base/parallel_for.hpp"
#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {
namespace {

using Corners = std::array<Vec3, 3>;

bool meet_in_mesh(const Corners& a, const std::array<int, 3>& vertices_a, const Corners& b,
                  const std::array<int, 3>& vertices_b, double tolerance_m) noexcept {
  const auto find_in = [](const std::array<int, 3>& vertices, int vertex) {
    return static_cast<std::size_t>(std::ranges::find(vertices, vertex) - vertices.begin());
  };
  std::size_t shared = 0, at_a = 0, at_b = 0, other_a = 0, other_b = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (const std::size_t found = find_in(vertices_b, vertices_a[i]); found < 3) {
      ++shared;
      at_a = i;
      at_b = found;
    } else {
      other_a = i;
    }
    if (find_in(vertices_a, vertices_b[i]) == 3) other_b = i;
  }
  if (shared == 0) return meet(a, b, tolerance_m);
  if (shared == 1) {
    return meets(a, b[(at_b + 1) % 3], b[(at_b + 2) % 3], tolerance_m) ||
           meets(b, a[(at_a + 1) % 3], a[(at_a + 2) % 3], tolerance_m);
  }
  return shared == 3 || meets(a, b[other_b], b[other_b], tolerance_m) || meets(b, a[other_a], a[other_a], tolerance_m);
}

}  // namespace

/// The segment is clipped by five planes, and meets the triangle if something remains. Two planes are parallel to the
/// triangle, at the distance `tolerance_m` on either side. Each of the other three contains a side of the triangle and
/// is moved outwards by `tolerance_m`.
bool meets(const Corners& corners, const Vec3& p, const Vec3& q, double tolerance_m) noexcept {
  const Vec3 across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double size = across.norm();
  if (!(size > 0)) return false;
  const Vec3 normal = across / size;
  double from = 0, to = 1;
  // Keeps the part of the segment that is at most `tolerance_m` above a plane. p_m and q_m are the heights of the
  // segment's ends above the plane.
  const auto cut = [&](double p_m, double q_m) {
    p_m -= tolerance_m;
    q_m -= tolerance_m;
    if (p_m > 0 && q_m > 0) to = -1;
    if (p_m > 0 && q_m <= 0) from = std::max(from, p_m / (p_m - q_m));
    if (p_m <= 0 && q_m > 0) to = std::min(to, p_m / (p_m - q_m));
  };
  const double p_m = normal.dot(p - corners[0]), q_m = normal.dot(q - corners[0]);
  cut(p_m, q_m);
  cut(-p_m, -q_m);
  for (std::size_t i = 0; i < 3 && from <= to; ++i) {
    const Vec3 out = (corners[(i + 1) % 3] - corners[i]).cross(normal).normalized();
    cut(out.dot(p - corners[i]), out.dot(q - corners[i]));
  }
  return from <= to;
}

bool meet(const Corners& a, const Corners& b, double tolerance_m) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    if (meets(a, b[i], b[(i + 1) % 3], tolerance_m) || meets(b, a[i], a[(i + 1) % 3], tolerance_m)) return true;
  }
  return false;
}

std::vector<std::size_t> crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::size_t triangle,
                                  double tolerance_m, std::vector<TriangleTree::Near>& near, std::size_t& work) {
  const Corners corners = corners_of(mesh, triangle);
  const Vec3 low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]).array() - tolerance_m;
  const Vec3 high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]).array() + tolerance_m;
  constexpr std::size_t kUsual = 64;
  if (near.empty()) near.resize(kUsual);
  std::size_t count = tree.within({low, high}, near);
  for (; count > near.size(); count = tree.within({low, high}, near)) near.resize(4 * near.size());
  work += count;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < count; ++i) {
    const auto other = static_cast<std::size_t>(near[i].triangle);
    if (other == triangle) continue;
    const Corners of_other = {near[i].a, near[i].a + near[i].ab, near[i].a + near[i].ac};
    if (meet_in_mesh(corners, mesh.triangles[triangle], of_other, mesh.triangles[other], tolerance_m))
      found.push_back(other);
  }
  return found;
}

void visit_crossing(const TriangleMesh& mesh, const TriangleTree& tree, std::span<const int> triangles,
                    double tolerance_m, int threads, std::size_t& work,
                    const std::function<bool(std::size_t triangle, std::span<const std::size_t> others)>& visit) {
  constexpr std::size_t kFirst = 64, kMost = 2048, kByOne = 32;
  /// Limit of the work that is done before the calls of `visit` for its results. It is wasted if `visit` ends the loop.
  constexpr std::size_t kWorkAhead = 200'000;
  std::vector<std::vector<std::size_t>> found(kMost);
  std::vector<std::size_t> works(kMost);
  std::size_t at_once = kFirst;
  for (std::size_t first = 0, count = 0; first < triangles.size(); first += count) {
    count = std::min(at_once, triangles.size() - first);
    parallel_for(threads, (count + kByOne - 1) / kByOne, [&](std::size_t part) {
      std::vector<TriangleTree::Near> near;
      for (std::size_t i = part * kByOne; i < std::min(count, (part + 1) * kByOne); ++i) {
        works[i] = 0;
        found[i] = crossing(mesh, tree, static_cast<std::size_t>(triangles[first + i]), tolerance_m, near, works[i]);
      }
    });
    std::size_t of_these = 0;
    for (std::size_t i = 0; i < count; ++i) {
      work += works[i];
      of_these += works[i];
      if (!visit(static_cast<std::size_t>(triangles[first + i]), found[i])) return;
    }
    at_once = std::clamp(kWorkAhead * count / (1 + of_these), std::size_t{1}, std::min(2 * count, kMost));
  }
}

}  // namespace tandem::geometry
