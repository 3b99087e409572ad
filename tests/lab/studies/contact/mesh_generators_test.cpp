// Tests that the meshes of the benchmarks have their documented properties: the counts are those of the source thesis,
// and the meshes are closed.
#include "lab/studies/contact/mesh_generators.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::lab {
namespace {

/// Returns whether each edge is used by exactly one triangle in each direction.
bool is_closed(const geometry::TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;
  for (const auto& [a, b, c] : mesh.triangles) {
    ++uses[{a, b}];
    ++uses[{b, c}];
    ++uses[{c, a}];
  }
  return std::all_of(uses.begin(), uses.end(), [&uses](const auto& use) {
    const auto opposite = uses.find({use.first.second, use.first.first});
    return use.second == 1 && opposite != uses.end() && opposite->second == 1;
  });
}

/// Returns the area of a regular polygon with corners at `radius`.
double polygon_area(int sides, double radius) {
  return 0.5 * sides * radius * radius * std::sin(2 * std::numbers::pi / sides);
}

TEST(MeshGenerators, PegHas180TrianglesIsClosedAndHasTheVolumeOfItsPrisms) {
  const geometry::TriangleMesh peg = make_peg();
  EXPECT_EQ(peg.triangles.size(), 180U);
  EXPECT_TRUE(is_closed(peg));
  const double wide = polygon_area(30, kPegRadius_m), narrow = polygon_area(30, kPegRadius_m - kPegChamfer_m);
  const double frustum = kPegChamfer_m / 3 * (wide + narrow + std::sqrt(wide * narrow));
  EXPECT_NEAR(volume_m3(peg), wide * (kPegLength_m - kPegChamfer_m) + frustum, 1e-15);
}

TEST(MeshGenerators, BoxWithHoleHas176TrianglesIsClosedAndLacksThePrismOfItsHole) {
  constexpr double kClearance_m = 2e-4;
  const geometry::TriangleMesh box = make_box_with_hole(kClearance_m);
  EXPECT_EQ(box.triangles.size(), 176U);
  EXPECT_TRUE(is_closed(box));
  const double hole = (kPegRadius_m + kClearance_m) / std::cos(std::numbers::pi / 40);
  EXPECT_NEAR(volume_m3(box), (kBoxWidth_m * kBoxWidth_m - polygon_area(40, hole)) * kBoxHeight_m, 1e-15);
}

TEST(MeshGenerators, ThePegLeavesTheStatedClearanceHoweverItIsTurned) {
  for (const double clearance_m : {1e-4, 5e-4, 1e-3}) {
    const geometry::TriangleMesh peg = make_peg();
    const geometry::TriangleMesh box = make_box_with_hole(clearance_m);
    double peg_radius = 0;
    for (const Vec3& p : peg.vertices) peg_radius = std::max(peg_radius, p.head<2>().norm());
    // Smallest distance of the hole's wall from the axis, at the midpoints of the sides.
    double hole_radius = 1;
    for (int i = 0; i < 40; ++i) {
      const Vec3 &p = box.vertices[static_cast<std::size_t>(i)],
                 &q = box.vertices[static_cast<std::size_t>((i + 1) % 40)];
      hole_radius = std::min(hole_radius, ((p + q) / 2).head<2>().norm());
    }
    EXPECT_NEAR(hole_radius - peg_radius, clearance_m, 1e-12);
  }
}

TEST(MeshGenerators, SphereAndCubeAreClosedAndFaceOutwards) {
  const geometry::TriangleMesh sphere = make_sphere(0.02, 3);
  EXPECT_EQ(sphere.triangles.size(), 20U * 64U);
  EXPECT_TRUE(is_closed(sphere));
  const double ball = 4.0 / 3 * std::numbers::pi * 8e-6;
  EXPECT_LT(volume_m3(sphere), ball);
  EXPECT_GT(volume_m3(sphere), 0.98 * ball);  // measured: 0.989 of the ball's volume
  const geometry::TriangleMesh cube = make_cube(0.05);
  EXPECT_TRUE(is_closed(cube));
  EXPECT_NEAR(volume_m3(cube), 1.25e-4, 1e-16);
}

TEST(MeshGenerators, SubdivisionStaysClosedAndMovesOnlyNewCornersALittle) {
  const geometry::TriangleMesh coarse = make_sphere(0.02, 2);
  const double height_m = 1e-5;
  for (const int pieces : {1, 2, 3, 4}) {
    const geometry::TriangleMesh fine = subdivided(coarse, pieces, height_m);
    EXPECT_EQ(fine.triangles.size(), static_cast<std::size_t>(pieces * pieces) * coarse.triangles.size());
    EXPECT_TRUE(is_closed(fine)) << pieces;
    for (std::size_t i = 0; i < coarse.vertices.size(); ++i) EXPECT_EQ(fine.vertices[i], coarse.vertices[i]);
    const geometry::TriangleMesh flat = subdivided(coarse, pieces, 0);
    EXPECT_NEAR(volume_m3(flat), volume_m3(coarse), 1e-12 * volume_m3(coarse)) << "cut, not bent";
    double moved = 0;
    for (std::size_t i = 0; i < fine.vertices.size(); ++i) {
      moved = std::max(moved, (fine.vertices[i] - flat.vertices[i]).norm());
    }
    EXPECT_LE(moved, height_m * (1 + 1e-9));
    EXPECT_GT(moved, pieces > 1 ? 0.5 * height_m : -1);
  }
}

}  // namespace
}  // namespace tandem::lab
