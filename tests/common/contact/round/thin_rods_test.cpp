// Tests the detection of thin rods in meshes, and the messages about shapes that are too thin.
#include "common/contact/round/thin_rods.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "common/contact/contact_shape.hpp"
#include "common/contact/round/too_thin.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/tessellation.hpp"

namespace tandem::contact {
namespace {

using geometry::TriangleMesh;

double thin_radius_m(const TriangleMesh& mesh) {
  return thin_rod_radius_m(mesh, geometry::TriangleTree(mesh), 4e-4);
}

TriangleMesh together(TriangleMesh a, const TriangleMesh& b, const Vec3& at) {
  const auto first = static_cast<int>(a.vertices.size());
  for (const Vec3& vertex : b.vertices) a.vertices.push_back(vertex + at);
  for (const auto& triangle : b.triangles) {
    a.triangles.push_back({triangle[0] + first, triangle[1] + first, triangle[2] + first});
  }
  return a;
}

TEST(ThinRods, OfAMeshHaveTheRadiusOfTheBallsInThem) {
  for (const double radius_m : {5e-5, 1e-4, 3e-4}) {
    EXPECT_NEAR(thin_radius_m(geometry::tessellated_cylinder(radius_m, 0.02)), radius_m, 0.03 * radius_m);
    EXPECT_NEAR(thin_radius_m(geometry::tessellated_box({2 * radius_m, 2 * radius_m, 0.02})), radius_m, 0.5 * radius_m);
  }
}

TEST(ThinRods, AreFoundBesideSomethingLarge) {
  const TriangleMesh grip = geometry::tessellated_box({0.01, 0.01, 0.01});
  const TriangleMesh needle = geometry::tessellated_cylinder(1e-4, 0.03);
  EXPECT_NEAR(thin_radius_m(together(grip, needle, {0, 0, 0.0201})), 1e-4, 5e-6);
}

TEST(ThinRods, AreNeitherPlatesNorWedgesNorThickOnes) {
  const double none = std::numeric_limits<double>::infinity();
  EXPECT_EQ(thin_radius_m(geometry::tessellated_box({2e-4, 0.02, 0.02})), none);
  EXPECT_EQ(thin_radius_m(geometry::tessellated_cylinder(0.01, 2e-4)), none) << "a disc";
  EXPECT_EQ(thin_radius_m(geometry::tessellated_cylinder(5e-4, 0.02)), none);
  EXPECT_EQ(thin_radius_m(geometry::tessellated_sphere(0.01)), none);
}

TEST(TooThin, IsAWallThinnerThanTheRigidContactDepth) {
  using ::testing::HasSubstr;
  EXPECT_THAT(why_too_thin(*make_contact_capsule(6e-5, 0.01)), HasSubstr("is 0.12 mm thick, too thin to hold"));
  EXPECT_EQ(why_too_thin(*make_contact_capsule(1e-4, 0.01)), "");
  EXPECT_THAT(why_too_thin(*make_contact_capsule(1e-4, 2)), HasSubstr("make it shorter"));
  const auto mesh_of = [](double radius_m) {
    return make_contact_mesh(geometry::repaired(geometry::tessellated_cylinder(radius_m, 0.002)));
  };
  EXPECT_THAT(why_too_thin(*mesh_of(6e-5)), HasSubstr("too thin to hold"));
  EXPECT_EQ(why_too_thin(*mesh_of(1e-4)), "");
  EXPECT_EQ(why_too_thin(*make_contact_box({0.01, 0.01, 2e-4})), "");
  EXPECT_THAT(why_too_thin(*make_contact_box({0.01, 0.01, 1e-4})), HasSubstr("is 0.1 mm thick"));
}

}  // namespace
}  // namespace tandem::contact
