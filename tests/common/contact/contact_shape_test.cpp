#include "common/contact/contact_shape.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "common/base/byte_io.hpp"
#include "common/base/random.hpp"
#include "common/geometry/packing.hpp"
#include "common/geometry/tessellation.hpp"
#include "tests/common/contact/mesh_measures.hpp"

namespace tandem::contact {
namespace {

geometry::ContactMesh mesh_box(const Vec3& size_m) {
  return {geometry::tessellated_box(size_m), geometry::SurfaceKind::kSolid, {}};
}

/// Reads all data of a shape that the contact search uses, so that a sanitizer or a crash detects invalid data. Returns
/// a sum, so that the compiler cannot remove the reads.
double used(const ContactShape& shape, Random& random) {
  double sum = shape.rigid_depth_m;
  for (int i = 0; i < 50; ++i) {
    const Vec3 p(random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02));
    const DistanceSample sample = shape.field->sample(p);
    sum += sample.distance_m + sample.gradient.x() + shape.field->distance_m(100 * p);
  }
  for (const PointShell* shell : {&shape.shells.surface, &shape.shells.features}) {
    for (std::uint32_t i = 0; i < shell->nodes.size(); i = random.uniform() < 0.5 ? i + 1 : shell->nodes[i].next) {
      const ShellNode& node = shell->nodes[i];
      if (node.is_leaf) sum += shell->points[node.first + node.count - 1].area_m2;
    }
  }
  return sum;
}

void seal(std::vector<std::uint8_t>& bytes) {
  bytes.resize(bytes.size() - sizeof(std::uint64_t));
  end_asset(bytes);
}

TEST(ContactShape, IsRigidBeforeThePressingSideSeesTheFarSide) {
  // Two shapes: a wall of 2 mm and a foil of 0.4 mm, each as a primitive and as a mesh.
  const Vec3 wall(0.02, 0.02, 2e-3);
  const Vec3 foil(0.02, 0.02, 4e-4);
  EXPECT_NEAR(make_contact_box(wall)->rigid_depth_m, 4e-4, 1e-9);
  EXPECT_NEAR(make_contact_mesh(mesh_box(wall))->rigid_depth_m, 4e-4, 6e-5);
  EXPECT_NEAR(make_contact_box(foil)->rigid_depth_m, 8e-5, 1e-9);
  EXPECT_LT(make_contact_mesh(mesh_box(foil))->rigid_depth_m, 1.5e-4);
}

TEST(ContactShape, IsNotThinBecauseItHasEdges) {
  EXPECT_EQ(make_contact_mesh(mesh_box(Vec3::Constant(0.01)))->rigid_depth_m, 5e-4);
}

TEST(ContactShape, BoundsItsPoints) {
  const auto box = make_contact_box(Vec3(0.02, 0.03, 0.05));
  EXPECT_LT((box->low_S - Vec3(-0.01, -0.015, -0.025)).norm(), 1e-8);
  EXPECT_LT((box->high_S - Vec3(0.01, 0.015, 0.025)).norm(), 1e-8);
  for (const ShellPoint& point : box->shells.surface.points) ASSERT_LE(point.p_S.norm(), box->radius_m() + 1e-9);
}

TEST(ContactShape, HasItsPointsOnTheSurfaceOfItsField) {
  // Two shapes: a solid and a bent sheet. A sheet is represented by a thin plate around it, so its points lie on the
  // surface of the plate.
  const geometry::ContactMesh roof{
      height_field(0.02, 20, [](double x, double) { return 0.5 * std::abs(x); }), geometry::SurfaceKind::kSheet, {}};
  for (const geometry::ContactMesh& mesh : {mesh_box(Vec3(0.01, 0.008, 0.006)), roof}) {
    const auto shape = make_contact_mesh(mesh);
    // The grid rounds a crease by a fraction of a cell. The tolerance is therefore larger than for smooth surfaces.
    const double tolerance_m = 1e-4;
    double sum = 0;
    for (const ShellPoint& point : shape->shells.surface.points) {
      const double distance = shape->field->distance_m(point.p_S.cast<double>());
      ASSERT_NEAR(distance, 0, tolerance_m) << point.p_S.transpose();
      sum += std::abs(distance);
    }
    EXPECT_LT(sum / static_cast<double>(shape->shells.surface.points.size()), 1e-5);
  }
}

TEST(ContactShape, RefusesSizesThatAreNotPositive) {
  EXPECT_THROW(make_contact_sphere(0), std::invalid_argument);
  EXPECT_THROW(make_contact_box(Vec3(0.1, -0.1, 0.1)), std::invalid_argument);
  EXPECT_THROW(make_contact_cylinder(0.1, std::numeric_limits<double>::infinity()), std::invalid_argument);
  EXPECT_THROW(make_contact_capsule(std::numeric_limits<double>::quiet_NaN(), 0.1), std::invalid_argument);
}

TEST(ContactShape, RefusesAMeshWhereSinglePrecisionIsTooCoarse) {
  const auto cube_at = [](double distance_m) {
    geometry::ContactMesh mesh = mesh_box(Vec3::Constant(0.005));
    for (Vec3& vertex : mesh.mesh.vertices) vertex.x() += distance_m;
    return mesh;
  };
  // At 5 m from the origin, points are rounded by up to 0.3 µm. This is far less than their spacing of 450 µm, so the
  // mesh is accepted.
  EXPECT_NE(make_contact_mesh(cube_at(5)), nullptr);
  try {
    make_contact_mesh(cube_at(700));
    FAIL() << "accepted";
  } catch (const geometry::MeshError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("reaches 700 m from its origin"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("round its points by 0.0417 mm"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("\"centre\": true"));
  }
}

TEST(ContactShape, ReportsProgressUpToOne) {
  std::vector<double> steps;
  make_contact_mesh(mesh_box(Vec3::Constant(0.01)), {}, [&steps](double done) { steps.push_back(done); });
  ASSERT_FALSE(steps.empty());
  EXPECT_TRUE(std::is_sorted(steps.begin(), steps.end()));
  EXPECT_GE(steps.front(), 0);
  EXPECT_EQ(steps.back(), 1);
}

class ContactAsset : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    // The shape measures only 3 mm, so that thousands of damaged copies are tested quickly. It is not compressed,
    // because decompression would already detect most damaged bytes.
    asset = contact_asset_bytes(*make_contact_mesh(mesh_box(Vec3(3e-3, 3e-3, 2e-3))), 0);
  }
  static inline std::vector<std::uint8_t> asset;
};

TEST_F(ContactAsset, IsTheSameShapeAgain) {
  const auto shape = contact_shape_from(asset);
  ASSERT_TRUE(shape);
  EXPECT_EQ(contact_asset_bytes(*shape, 0), asset);
  const auto original = make_contact_mesh(mesh_box(Vec3(3e-3, 3e-3, 2e-3)));
  EXPECT_EQ(shape->low_S, original->low_S);
  EXPECT_EQ(shape->high_S, original->high_S);
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p(random.uniform(-0.003, 0.003), random.uniform(-0.003, 0.003), random.uniform(-0.003, 0.003));
    ASSERT_EQ(shape->field->distance_m(p), original->field->distance_m(p));
  }
}

TEST_F(ContactAsset, IsNotReadWhenTorn) {
  for (std::size_t size = 0; size < asset.size(); size += 1 + asset.size() / 500) {
    EXPECT_FALSE(contact_shape_from(std::span(asset).first(size))) << size;
    // The truncated bytes are tested again with a valid checksum, so that other checks of the reader must detect the
    // truncation.
    std::vector<std::uint8_t> cut(asset.begin(), asset.begin() + static_cast<std::ptrdiff_t>(size));
    if (cut.size() < sizeof(std::uint64_t)) continue;
    seal(cut);
    EXPECT_FALSE(contact_shape_from(cut)) << size;
  }
}

TEST_F(ContactAsset, IsNotReadWhenAByteHasChanged) {
  Random random(2);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::uint8_t> damaged = asset;
    damaged[random.next_u32() % damaged.size()] ^= static_cast<std::uint8_t>(1U << (random.next_u32() % 8));
    EXPECT_FALSE(contact_shape_from(damaged));
  }
}

TEST_F(ContactAsset, SurvivesHostileBytes) {
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    std::vector<std::uint8_t> hostile = asset;
    const std::uint32_t changes = 1 + random.next_u32() % 4;
    for (std::uint32_t k = 0; k < changes; ++k) {
      // Half of the changes affect the headers, because a wrong count there is the most dangerous damage.
      const std::size_t range = random.uniform() < 0.5 ? 256 : hostile.size();
      hostile[random.next_u32() % range] = static_cast<std::uint8_t>(random.next_u32());
    }
    seal(hostile);
    const auto shape = contact_shape_from(hostile);
    if (!shape) {
      ++refused;
      continue;
    }
    ASSERT_TRUE(std::isfinite(used(*shape, random)));
  }
  EXPECT_GT(refused, 500);
}

TEST_F(ContactAsset, IsTheSameShapePacked) {
  const auto shape = contact_shape_from(asset);
  const std::vector<std::uint8_t> packed = contact_asset_bytes(*shape);
  EXPECT_LT(8 * packed.size(), shape->memory_bytes());
  EXPECT_EQ(contact_asset_bytes(*contact_shape_from(packed), 0), asset);
}

// A few malicious kilobytes may declare gigabytes of zeros, or decompress to many megabytes. The reader must refuse
// them.
TEST_F(ContactAsset, UsesNoMoreMemoryThanAllowed) {
  const auto shape = contact_shape_from(asset);
  EXPECT_TRUE(contact_shape_from(asset, shape->memory_bytes()));
  EXPECT_FALSE(contact_shape_from(asset, shape->memory_bytes() - 1));

  std::vector<std::uint8_t> bomb;
  geometry::append_block(bomb, std::vector<std::uint8_t>(std::size_t{64} << 20U), kPackingLevel);
  ASSERT_LT(bomb.size(), 16'384U);
  std::span<const std::uint8_t> rest(bomb);
  ByteReader reader(rest);
  EXPECT_FALSE(geometry::read_block(reader, std::size_t{1} << 20U));
  // The block now declares 1,000 bytes, which is less than its data has after decompression.
  const std::uint32_t stated = 1000;
  std::memcpy(bomb.data(), &stated, sizeof(stated));
  rest = bomb;
  EXPECT_FALSE(geometry::read_block(reader, std::size_t{1} << 20U));
}

TEST_F(ContactAsset, IsOnlyMadeOfMeshes) {
  EXPECT_THROW(contact_asset_bytes(*make_contact_sphere(0.005)), std::invalid_argument);
}

// The origin of an asset is the key under which a cache stores it; its format is free. If any input of the asset
// differs, the origins must differ. Otherwise the cache would return a wrong asset.
TEST_F(ContactAsset, ItsOriginContainsEverythingThatItsBytesDependOn) {
  const geometry::ContactMesh mesh = mesh_box(Vec3(3e-3, 3e-3, 2e-3));
  std::vector<std::vector<std::uint8_t>> origins{contact_asset_origin(mesh, {})};
  for (double ContactShapeOptions::*option :
       {&ContactShapeOptions::cell_m, &ContactShapeOptions::tolerance_m, &ContactShapeOptions::band_m,
        &ContactShapeOptions::spacing_m, &ContactShapeOptions::feature_angle_deg,
        &ContactShapeOptions::feature_spacing_m, &ContactShapeOptions::feature_height_m,
        &ContactShapeOptions::sheet_thickness_m}) {
    ContactShapeOptions options;
    options.*option *= 2;
    origins.push_back(contact_asset_origin(mesh, options));
  }
  for (std::size_t ContactShapeOptions::*option :
       {&ContactShapeOptions::max_grid_bytes, &ContactShapeOptions::max_points}) {
    ContactShapeOptions options;
    options.*option /= 2;
    origins.push_back(contact_asset_origin(mesh, options));
  }
  for (geometry::TriangleMesh geometry::ContactMesh::*part :
       {&geometry::ContactMesh::mesh, &geometry::ContactMesh::sheet, &geometry::ContactMesh::inner}) {
    geometry::ContactMesh other = mesh;
    (other.*part).vertices.emplace_back(1, 2, 3);
    origins.push_back(contact_asset_origin(other, {}));
    other = mesh;
    (other.*part).triangles.push_back({0, 1, 2});
    origins.push_back(contact_asset_origin(other, {}));
  }
  geometry::ContactMesh sheet = mesh;
  sheet.kind = geometry::SurfaceKind::kSheet;
  origins.push_back(contact_asset_origin(sheet, {}));
  const std::size_t count = origins.size();
  std::ranges::sort(origins);
  EXPECT_EQ(std::unique(origins.begin(), origins.end()), origins.end()) << "of " << count;
  ContactShapeOptions threads;
  threads.threads = 7;
  EXPECT_EQ(contact_asset_origin(mesh, threads), contact_asset_origin(mesh, {})) << "their number does not show";
}

TEST(ContactShape, RefusesBadOptionsOfASheetBeforeItIsSampled) {
  geometry::ContactMesh sheet;
  sheet.mesh.vertices = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}};
  sheet.mesh.triangles = {{0, 1, 2}};
  sheet.kind = geometry::SurfaceKind::kSheet;
  for (const double thickness_m : {std::numeric_limits<double>::quiet_NaN(), -1e-3, 1e9}) {
    ContactShapeOptions options;
    options.sheet_thickness_m = thickness_m;
    EXPECT_THROW(make_contact_mesh(sheet, options), std::invalid_argument) << thickness_m;
  }
}

}  // namespace
}  // namespace tandem::contact
