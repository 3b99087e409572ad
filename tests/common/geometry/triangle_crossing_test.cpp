#include "common/geometry/triangle_crossing.hpp"

#include <gmock/gmock.h>

#include <numeric>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "tests/common/contact/test_meshes.hpp"

namespace tandem::geometry {
namespace {

constexpr double kTolerance_m = 1e-9;

struct Visits {
  std::vector<std::pair<std::size_t, std::vector<std::size_t>>> all;
  std::size_t work = 0;
};

Visits visits(const TriangleMesh& mesh, int threads, std::size_t most) {
  const TriangleTree tree(mesh);
  std::vector<int> triangles(mesh.triangles.size());
  std::iota(triangles.rbegin(), triangles.rend(), 0);
  Visits found;
  visit_crossing(mesh, tree, triangles, kTolerance_m, threads, found.work,
                 [&](std::size_t triangle, std::span<const std::size_t> others) {
                   found.all.emplace_back(triangle, std::vector(others.begin(), others.end()));
                   return found.all.size() < most;
                 });
  return found;
}

// Two intersecting balls. Each ball has more triangles than visit_crossing() processes in one batch.
TriangleMesh crossing_balls() {
  TriangleMesh other = contact::sphere_mesh(0.02, 4);
  for (Vec3& vertex : other.vertices) vertex += Vec3(0.013, 0.003, 0.001);
  return joined(contact::sphere_mesh(0.02, 4), other);
}

TEST(VisitCrossing, FindsTheResultOfTryingAllInTheSameOrder) {
  const TriangleMesh mesh = crossing_balls();
  const Visits found = visits(mesh, 3, mesh.triangles.size());
  ASSERT_EQ(found.all.size(), mesh.triangles.size());
  std::size_t crossings = 0;
  for (std::size_t i = 0; i < found.all.size(); ++i) {
    const auto& [triangle, others] = found.all[i];
    ASSERT_EQ(triangle, mesh.triangles.size() - 1 - i);
    if (i % 10 != 0 && others.empty()) continue;
    std::vector<std::size_t> expected;
    for (std::size_t other = 0; other < mesh.triangles.size(); ++other) {
      // Only triangles of different balls count. Triangles of the same ball share vertices or do not touch.
      const bool is_of_other_ball = (other < mesh.triangles.size() / 2) != (triangle < mesh.triangles.size() / 2);
      if (is_of_other_ball && meet(corners_of(mesh, triangle), corners_of(mesh, other), kTolerance_m))
        expected.push_back(other);
    }
    ASSERT_THAT(others, testing::UnorderedElementsAreArray(expected)) << triangle;
    crossings += others.size();
  }
  EXPECT_GT(crossings, 100U);
}

TEST(VisitCrossing, DoesNotDependOnThreadsAndEndsWhereItIsTold) {
  const TriangleMesh mesh = crossing_balls();
  for (const std::size_t most : {std::size_t{1}, std::size_t{777}, mesh.triangles.size()}) {
    const Visits one = visits(mesh, 1, most), three = visits(mesh, 3, most);
    EXPECT_EQ(one.all.size(), most);
    EXPECT_EQ(one.all, three.all);
    EXPECT_EQ(one.work, three.work);
    EXPECT_GE(one.work, most) << "each finds itself";
  }
}

}  // namespace
}  // namespace tandem::geometry
