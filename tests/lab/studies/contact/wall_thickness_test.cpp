// Tests the wall thickness of solids for which it is known. Most of their meshes are as coarse as those of typical
// files.
#include "lab/studies/contact/wall_thickness.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/common/contact/test_meshes.hpp"

namespace tandem::lab {
namespace {

using geometry::TriangleMesh;

TriangleMesh together(TriangleMesh mesh, const TriangleMesh& other, bool is_flipped = false) {
  const auto first = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (auto [a, b, c] : other.triangles) {
    if (is_flipped) std::swap(b, c);
    mesh.triangles.push_back({first + a, first + b, first + c});
  }
  return mesh;
}

/// Returns a prism over a counter-clockwise polygon. The triangles of its ends share the first corner.
TriangleMesh prism(const std::vector<std::array<double, 2>>& outline, double height_m) {
  TriangleMesh mesh;
  const auto n = static_cast<int>(outline.size());
  for (const double z : {0.0, height_m}) {
    for (const auto& [x, y] : outline) mesh.vertices.emplace_back(x, y, z);
  }
  for (int i = 0; i < n; ++i) {
    const int k = (i + 1) % n;
    mesh.triangles.push_back({i, k, n + k});
    mesh.triangles.push_back({i, n + k, n + i});
    if (i == 0 || k == 0) continue;
    mesh.triangles.push_back({0, k, i});
    mesh.triangles.push_back({n, n + i, n + k});
  }
  return mesh;
}

TriangleMesh turned(TriangleMesh mesh) {
  const Eigen::AngleAxisd turn(0.7, Vec3(1, 2, 3).normalized());
  for (Vec3& vertex : mesh.vertices) vertex = turn * vertex;
  return mesh;
}

double thinnest_of(const TriangleMesh& mesh) {
  return thinnest_wall_m(walls_of(mesh).first);
}

TEST(WallThickness, OfABoxIsExactHoweverItLiesAndHoweverCoarseItIs) {
  for (const Vec3& size_m :
       {Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.1, 0.005), Vec3(0.1, 0.01, 0.01), Vec3(0.1, 0.07, 0.05)}) {
    EXPECT_NEAR(thinnest_of(contact::box_mesh(size_m)), size_m.minCoeff(), 1e-15) << size_m.transpose();
    EXPECT_NEAR(thinnest_of(turned(contact::box_mesh(size_m))), size_m.minCoeff(), 1e-12) << size_m.transpose();
  }
}

TEST(WallThickness, OfARoundRodIsItsDiameterAcrossTwoFaces) {
  for (const int sides : {8, 30, 64}) {
    std::vector<std::array<double, 2>> outline;
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      outline.push_back({0.01 * std::cos(angle), 0.01 * std::sin(angle)});
    }
    EXPECT_NEAR(thinnest_of(prism(outline, 0.1)), 0.02 * std::cos(std::numbers::pi / sides), 1e-12) << sides;
  }
}

TEST(WallThickness, OfAHollowBallIsTheGapBetweenItsFacesDownToAMicrometre) {
  for (const double wall_m : {0.01, 3e-4, 2e-5, 1e-6}) {
    const TriangleMesh shell = together(contact::sphere_mesh(0.05, 4), contact::sphere_mesh(0.05 - wall_m, 4), true);
    EXPECT_NEAR(thinnest_of(shell), wall_m, 0.02 * wall_m);
  }
  EXPECT_NEAR(thinnest_of(contact::sphere_mesh(0.05, 4)), 0.1, 0.001);
}

TEST(WallThickness, OfAWedgeIsThatOfAllButTwoHundredthsOfItsSurface) {
  const double height_m = 0.02, length_m = 0.1;
  const TriangleMesh wedge = prism({{0, -height_m / 2}, {length_m, 0}, {0, height_m / 2}}, 1.0);
  // The wedge has the angle α at its tip. At the distance s from the tip along a slanted side, its thickness
  // perpendicular to this side is s·tan α. Its thinnest wall is the 2 % quantile, i.e. the thickness at the s for which
  // 2 % of the area is nearer to the tip.
  const double slant_m = std::hypot(length_m, height_m / 2), alpha = 2 * std::atan2(height_m / 2, length_m);
  const double area_m2 = 2 * slant_m + height_m + length_m * height_m;
  EXPECT_NEAR(thinnest_of(wedge), 0.02 * area_m2 / 2 * std::tan(alpha), 2e-5);
}

TEST(WallThickness, FacesThatMeetAtAnEdgeBoundNone) {
  TriangleMesh corner;
  corner.vertices = {Vec3::Zero(), Vec3(0.1, 0, 0), Vec3(0, 0.1, 0), Vec3(0, 0, 0.1)};
  corner.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  EXPECT_EQ(thinnest_of(corner), 0);
}

TEST(WallThickness, OfPartsThatOverlapIsThatOfTheWholeAndTheOverlapIsTold) {
  const TriangleMesh plate = contact::box_mesh({0.1, 0.06, 0.006});
  // A fin with a thickness of 1.5 mm is embedded 1 mm deep in the plate. The thinnest wall is 1.5 mm, not 1 mm.
  const auto [walls, share] = walls_of(together(plate, contact::box_mesh({0.0015, 0.06, 0.03}, {0, 0, 0.017})));
  EXPECT_NEAR(thinnest_wall_m(walls), 0.0015, 1e-12);
  EXPECT_NEAR(share, 2 * 0.0015 * 0.06 / (0.1 * 0.06 * 2 + 0.32 * 0.006 + 2 * 0.06 * 0.03), 0.01);
  EXPECT_EQ(walls_of(plate).second, 0);
}

TEST(WallThickness, OfABlockThatStandsOnAnotherIsThatOfBothAndNothingOverlaps) {
  const auto [walls, share] =
      walls_of(together(contact::box_mesh({0.1, 0.1, 0.01}), contact::box_mesh({0.1, 0.1, 0.01}, {0, 0, 0.01})));
  EXPECT_NEAR(thinnest_wall_m(walls), 0.02, 1e-12);
  EXPECT_EQ(share, 0);
}

}  // namespace
}  // namespace tandem::lab
