// A mesh of any size must either have a size that is a safe divisor, or be refused with a message. This includes an
// empty mesh.
#include "common/geometry/repair/mesh_bounds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "common/base/random.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "tests/support/degenerate_meshes.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::geometry {
namespace {

using ::testing::HasSubstr;

std::string size_error(const TriangleMesh& mesh) {
  try {
    mesh_bounds(mesh);
  } catch (const MeshError& error) {
    return error.what();
  }
  return "";
}

TEST(MeshBounds, IsTheBoxAroundTheVerticesOfTriangles) {
  const TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 2, -3}, {1e300, 0, 0}}, {{0, 1, 2}}};
  const Eigen::AlignedBox3d box = mesh_bounds(mesh);
  EXPECT_EQ(box.min(), Vec3(0, 0, -3));
  EXPECT_EQ(box.max(), Vec3(1, 2, 0));
}

TEST(MeshBounds, ReportsAMeshWithoutSizeAndItsPosition) {
  EXPECT_THAT(size_error({}), HasSubstr("no triangle"));
  const TriangleMesh point{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, {{0, 1, 2}}};
  EXPECT_THAT(size_error(point), HasSubstr("at one place, (1, 2, 3)"));
  TriangleMesh far = point;
  far.vertices[1].x() = 2e100;
  EXPECT_THAT(size_error(far), HasSubstr("vertex 1 is at (2e+100, 2, 3)"));
  far.vertices[1].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(size_error(far), HasSubstr("vertex 1 is at"));
}

/// Scales a mesh to a length, as when a scene is loaded, and repairs it. Returns nothing if the mesh is refused.
std::optional<ContactMesh> made_ready(TriangleMesh mesh, double largest_size_m) {
  try {
    const Eigen::AlignedBox3d box = mesh_bounds(mesh);
    const double scale = largest_size_m / box.sizes().maxCoeff();
    EXPECT_TRUE(std::isfinite(scale) && scale > 0) << scale;
    for (Vec3& vertex : mesh.vertices) vertex = (vertex - box.center()) * scale;
    return repaired(mesh);
  } catch (const MeshError&) {
    return std::nullopt;
  }
}

TEST(MeshBounds, EveryDegenerateMeshIsRefusedOrFiniteOnceItIsScaled) {
  Random random(test::test_seed(59));
  int ready = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const TriangleMesh mesh = test::degenerate_mesh(random);
    const double size_m = std::exp(random.uniform(std::log(1e-6), std::log(100.0)));
    const auto made = made_ready(mesh, size_m);
    if (!made) continue;
    ++ready;
    for (const TriangleMesh* part : {&made->mesh, &made->sheet, &made->inner}) {
      for (const Vec3& vertex : part->vertices) {
        ASSERT_TRUE(vertex.allFinite()) << "trial " << trial;
        ASSERT_LE(vertex.cwiseAbs().maxCoeff(), size_m) << "trial " << trial;
      }
    }
    for (const PartReport& part : made->parts) ASSERT_TRUE(std::isfinite(part.volume_m3)) << "trial " << trial;
  }
  EXPECT_GT(ready, 100) << "meshes that have a surface are among them";
}

}  // namespace
}  // namespace tandem::geometry
