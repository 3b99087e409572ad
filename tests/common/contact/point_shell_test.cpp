#include "common/contact/points/point_shell.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "common/base/random.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/tessellation.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "tests/common/contact/mesh_measures.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/support/needs.hpp"

namespace tandem::contact {
namespace {

/// Returns the distance from `p` to the nearest point of the shell that faces the same way, found with the shell's
/// tree. The result is limited to 2 mm, which is larger than the bounds of all tests in this file.
double distance_to_shell(const PointShell& shell, const Vec3& p, const Vec3& normal) {
  double least = 2e-3;
  for (std::uint32_t i = 0; i < shell.nodes.size();) {
    const ShellNode& node = shell.nodes[i];
    if ((node.centre_S.cast<double>() - p).norm() - node.radius_m > least) {
      i = node.next;
      continue;
    }
    for (std::uint32_t k = node.first; node.is_leaf && k < node.first + node.count; ++k) {
      if (shell.points[k].normal_S.cast<double>().dot(normal) <= 0) continue;
      least = std::min(least, (shell.points[k].p_S.cast<double>() - p).norm());
    }
    ++i;
  }
  return least < 2e-3 ? least : std::numeric_limits<double>::infinity();
}

geometry::ContactMesh solid(geometry::TriangleMesh mesh) {
  return {std::move(mesh), geometry::SurfaceKind::kSolid, {}};
}

/// Tests `count` random points on the surface. Returns the largest distance from one of them to the shell.
double worst_gap_m(const geometry::TriangleMesh& mesh, const PointShell& shell, int count) {
  Random random(99);
  double worst = 0;
  const double per_triangle = count / area_m2(mesh);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const double share = per_triangle * geometry::doubled_area(mesh, i).norm() / 2;
    for (double k = random.uniform(); k < share; ++k) {
      const SurfacePoint point = random_point(mesh, i, random);
      worst = std::max(worst, distance_to_shell(shell, point.p, point.normal));
    }
  }
  return worst;
}

struct Subject {
  std::string name;
  geometry::TriangleMesh mesh;
};

std::vector<Subject> subjects() {
  // The subjects are a cube, a plate thinner than the spacing, a rod of long narrow triangles, a finely divided ball,
  // and a wavy open surface.
  return {{"cube", geometry::tessellated_box(Vec3::Constant(0.02))},
          {"thin plate", geometry::tessellated_box(Vec3(0.03, 0.02, 2e-4))},
          {"rod", geometry::tessellated_cylinder(0.002, 0.1)},
          {"ball", geometry::tessellated_sphere(0.005)},
          {"waves",
           height_field(0.02, 100, [](double x, double y) { return 5e-4 * std::sin(3000 * x) * std::sin(2000 * y); })}};
}

TEST(PointShell, LeavesNoPointOfTheSurfaceFartherThanItsSpacing) {
  for (const Subject& subject : subjects()) {
    const PointShells shells = sample_surface(solid(subject.mesh), {}, {});
    EXPECT_EQ(shells.surface.spacing_m, 4.5e-4);
    EXPECT_LE(worst_gap_m(subject.mesh, shells.surface, 50'000), 4.5e-4) << subject.name;
  }
}

TEST(PointShell, SharesTheWholeSurfaceAmongItsPoints) {
  for (const Subject& subject : subjects()) {
    const PointShell shell = sample_surface(solid(subject.mesh), {}, {}).surface;
    EXPECT_NEAR(shell.area_m2() / area_m2(subject.mesh), 1, 1e-5) << subject.name;
    for (const ShellPoint& point : shell.points) {
      ASSERT_GT(point.area_m2, 0) << subject.name;
      // The surface assigned to a point lies in a ball around the point whose radius is the spacing. The limit is twice
      // the area of a disc with this radius. A larger area would be an error of the division.
      ASSERT_LT(point.area_m2, 2 * std::numbers::pi * 4.5e-4 * 4.5e-4) << subject.name;
      ASSERT_NEAR(point.normal_S.norm(), 1, 1e-5) << subject.name;
    }
  }
}

TEST(PointShell, SpreadsItsPointsApart) {
  const PointShell shell = sample_surface(solid(geometry::tessellated_sphere(0.005)), {}, {}).surface;
  for (std::size_t i = 0; i < shell.points.size(); ++i) {
    for (std::size_t k = i + 1; k < shell.points.size(); ++k) {
      ASSERT_GT((shell.points[i].p_S - shell.points[k].p_S).norm(), 0.89F * 4.5e-4F);
    }
  }
  // Densest random packing: 0.70 discs per square of their diameter, which is 0.9 of the spacing here. The limit is
  // 0.8, because the sphere is small. More points would only make the search slower.
  EXPECT_LT(static_cast<double>(shell.points.size()), 0.8 * shell.area_m2() / std::pow(0.9 * 4.5e-4, 2));
}

TEST(PointShell, HasBallsAroundAllPointsBelow) {
  const PointShell shell = sample_surface(solid(geometry::tessellated_box(Vec3::Constant(0.02))), {}, {}).surface;
  ASSERT_EQ(shell.nodes[0].count, shell.points.size());
  double leaf_points = 0;
  for (std::uint32_t i = 0; i < shell.nodes.size(); ++i) {
    const ShellNode& node = shell.nodes[i];
    double area = 0;
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
      area += shell.points[k].area_m2;
      ASSERT_LE((shell.points[k].p_S.cast<double>() - node.centre_S.cast<double>()).norm(), node.radius_m);
    }
    EXPECT_NEAR(node.mean.area_m2, area, 1e-6 * area);
    EXPECT_NEAR(node.mean.normal_S.norm(), 1, 1e-5);
    if (!node.is_leaf) continue;
    EXPECT_LE(node.count, kShellLeafPoints);
    EXPECT_EQ(node.next, i + 1);
    leaf_points += node.count;
  }
  EXPECT_EQ(leaf_points, static_cast<double>(shell.points.size()));
}

TEST(PointShell, SamplesCornersExactlyAndEdgesFinely) {
  const double half = 0.01;
  const PointShell features =
      sample_surface(solid(geometry::tessellated_box(Vec3::Constant(2 * half))), {}, {}).features;
  // Each of the 12 edges has 80 intervals, that is 79 inner points. The 8 corners are counted once.
  EXPECT_EQ(features.points.size(), 12U * 79 + 8);
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    Vec3 p((random.next_u32() & 1U) != 0 ? half : -half, (random.next_u32() & 1U) != 0 ? half : -half,
           (random.next_u32() & 1U) != 0 ? half : -half);
    EXPECT_LT(distance_to_shell(features, p, p), 1e-8);
    p[static_cast<int>(random.next_u32() % 3)] = random.uniform(-half, half);
    EXPECT_LE(distance_to_shell(features, p, p), 1.2501e-4);
  }
}

TEST(PointShell, FindsNoEdgesInAFineRoundSurface) {
  EXPECT_TRUE(sample_surface(solid(geometry::tessellated_sphere(0.01)), {}, {}).features.points.empty());
  const PointShell rims = sample_surface(solid(geometry::tessellated_cylinder(0.01, 0.03)), {}, {}).features;
  ASSERT_FALSE(rims.points.empty());
  for (const ShellPoint& point : rims.points) ASSERT_NEAR(std::abs(point.p_S.z()), 0.015F, 1e-6F);
}

TEST(PointShell, FindsEdgesThatPointOutOnly) {
  // A trough has rims that protrude and need feature points. The edges at its bottom need none, because another shape
  // cannot touch these edges first.
  const auto trough = height_field(0.02, 40, [](double x, double) { return std::abs(x) < 4.9e-3 ? -2e-3 : 0.0; });
  const PointShell features = sample_surface(solid(trough), {}, {}).features;
  ASSERT_FALSE(features.points.empty());
  for (const ShellPoint& point : features.points) ASSERT_GT(point.p_S.z(), -1e-6F);
}

TEST(PointShell, CatchesARidgeNarrowerThanItsSpacing) {
  // The ridge is 0.3 mm high. It falls to half of its height 0.1 mm from the crest. Its folds are too gentle to count
  // as a sharp edge.
  const double height = 3e-4;
  const auto crest_x = [](double y) { return 2e-4 * std::sin(2000 * y); };
  const auto ridge =
      height_field(0.008, 800, [&](double x, double y) { return height / (1 + std::pow((x - crest_x(y)) / 1e-4, 2)); });
  ContactShapeOptions options;
  options.feature_angle_deg = 60;
  const PointShell features = sample_surface(solid(ridge), options, {}).features;
  for (double y = -0.0025; y < 0.0025; y += 5e-5) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const ShellPoint& point : features.points) {
      if (point.p_S.z() < height - 6e-5) continue;
      nearest = std::min(nearest, (point.p_S.cast<double>() - Vec3(crest_x(y), y, height)).norm());
    }
    ASSERT_LT(nearest, 4.5e-4) << "y " << y;
  }
}

TEST(PointShell, MeetsEveryPlaneWhereTheBunnyDoes) {
  TANDEM_NEEDS_FILES(kBunnyFile);
  const geometry::ContactMesh mesh = solid(bunny_mesh(0.1));
  const PointShells shells = sample_surface(mesh, {}, {});
  Random random(17);
  for (int i = 0; i < 100; ++i) {
    const Vec3 direction = Vec3(random.normal(), random.normal(), random.normal()).normalized();
    double mesh_reach = -1;
    double shell_reach = -1;
    for (const Vec3& p : mesh.mesh.vertices) mesh_reach = std::max(mesh_reach, direction.dot(p));
    for (const ShellPoint& point : shells.surface.points) {
      shell_reach = std::max(shell_reach, direction.dot(point.p_S.cast<double>()));
    }
    // The bound is twice the height below which bumps are ignored, because a bump may face in another direction.
    EXPECT_LT(mesh_reach - shell_reach, 1e-4);
  }
  EXPECT_LE(worst_gap_m(mesh.mesh, shells.surface, 30'000), 4.5e-4);
  // The limit is small compared with the 34,835 vertices, because most folds of the mesh are gentle.
  EXPECT_LT(shells.features.points.size(), 7000U);
}

TEST(PointShell, WidensItsSpacingRatherThanGrow) {
  ContactShapeOptions options;
  options.max_points = 3000;
  const geometry::TriangleMesh mesh = geometry::tessellated_sphere(0.02);
  const PointShell shell = sample_surface(solid(mesh), options, {}).surface;
  EXPECT_LE(shell.points.size(), 3750U);
  EXPECT_GT(shell.points.size(), 2000U);
  EXPECT_GT(shell.spacing_m, 1e-3);
  EXPECT_LE(worst_gap_m(mesh, shell, 50'000), shell.spacing_m);
}

TEST(PointShell, OutlinesAPlateAroundASheet) {
  ContactShapeOptions options;
  options.sheet_thickness_m = 1e-3;
  const double half = 0.01;
  const geometry::ContactMesh sheet{
      height_field(2 * half, 4, [](double, double) { return 0.0; }), geometry::SurfaceKind::kSheet, {}};
  const PointShell shell = sample_surface(sheet, options, {}).surface;
  const auto foot = [half](const Vec3& p) {
    return Vec3(std::clamp(p.x(), -half, half), std::clamp(p.y(), -half, half), 0);
  };
  for (const ShellPoint& point : shell.points) {
    const Vec3 p = point.p_S.cast<double>();
    ASSERT_NEAR((p - foot(p)).norm(), 5e-4, 1e-8);
    ASSERT_GT(point.normal_S.cast<double>().dot((p - foot(p)).normalized()), 0.999);
  }
  Random random(23);
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 p(random.uniform(-1.2, 1.2) * half, random.uniform(-1.2, 1.2) * half, random.uniform(-1e-3, 1e-3));
    const Vec3 normal = (p - foot(p)).normalized();
    const Vec3 on_plate = foot(p) + 5e-4 * normal;
    ASSERT_LE(distance_to_shell(shell, on_plate, normal), shell.spacing_m) << on_plate.transpose();
  }
  // The expected area is that of two sides, half a tube around the rim, and a quarter of a ball at each corner.
  const double rim = std::numbers::pi * 5e-4;
  EXPECT_NEAR(shell.area_m2(), 8 * half * half + 8 * half * rim + 4 * rim * 5e-4, 0.02 * shell.area_m2());
}

TEST(PointShell, HasNoPointsInsideThePlateOfABentSheet) {
  const double size = 0.02;
  const geometry::ContactMesh sheet{
      height_field(size, 20, [](double x, double) { return std::abs(x); }), geometry::SurfaceKind::kSheet, {}};
  const geometry::TriangleTree tree(sheet.mesh);
  for (const ShellPoint& point : sample_surface(sheet, {}, {}).surface.points) {
    ASSERT_GT(tree.closest(point.p_S.cast<double>()).distance_m, 0.97 * 5e-4);
  }
}

TEST(PointShell, LiesOnTheExactSurfaceOfAPrimitive) {
  const auto field = cylinder_field(0.05, 0.02);
  const PointShells shells = sample_surface(geometry::tessellated_cylinder(0.05, 0.02), *field, {});
  for (const ShellPoint& point : shells.surface.points) {
    ASSERT_NEAR(field->distance_m(point.p_S.cast<double>()), 0, 1e-8);
  }
  ASSERT_FALSE(shells.features.points.empty());
  for (const ShellPoint& point : shells.features.points) {
    ASSERT_NEAR(point.p_S.head<2>().norm(), 0.05F, 1e-7F);
    ASSERT_NEAR(std::abs(point.p_S.z()), 0.01F, 1e-7F);
  }
}

TEST(PointShell, IsTheSameEachTime) {
  const geometry::ContactMesh mesh = solid(geometry::tessellated_cylinder(0.004, 0.01));
  std::vector<std::uint8_t> first;
  std::vector<std::uint8_t> second;
  sample_surface(mesh, {}, {}).surface.write(first, 0);
  sample_surface(mesh, {}, {}).surface.write(second, 0);
  EXPECT_EQ(first, second);
}

TEST(PointShell, ReadsOnlyTheFormatThatItWrites) {
  const PointShell shell = sample_surface(solid(geometry::tessellated_sphere(0.002)), {}, {}).surface;
  std::vector<std::uint8_t> bytes;
  shell.write(bytes, 0);
  bytes.push_back(77);
  std::span<const std::uint8_t> rest(bytes);
  const auto read = PointShell::read(rest, kMaxShapeBytes);
  ASSERT_TRUE(read);
  ASSERT_EQ(rest.size(), 1U);
  std::vector<std::uint8_t> again;
  read->write(again, 0);
  EXPECT_TRUE(std::equal(again.begin(), again.end(), bytes.begin()));

  bytes.pop_back();
  for (std::size_t size = 0; size < bytes.size(); size += 7) {
    std::span<const std::uint8_t> cut = std::span(bytes).first(size);
    ASSERT_FALSE(PointShell::read(cut, kMaxShapeBytes)) << size;
  }
}

TEST(PointShell, IsWithinTheStatedErrorOnceCoded) {
  const PointShell shell = sample_surface(solid(geometry::tessellated_sphere(0.02)), {}, {}).surface;
  std::vector<std::uint8_t> bytes;
  shell.write(bytes, kPackingLevel);
  std::span<const std::uint8_t> rest(bytes);
  const auto coded = PointShell::read(rest, kMaxShapeBytes);
  ASSERT_TRUE(coded);
  ASSERT_EQ(coded->points.size(), shell.points.size());
  EXPECT_LT(bytes.size(), 9 * shell.points.size());
  for (std::size_t i = 0; i < shell.points.size(); ++i) {
    const ShellPoint& before = shell.points[i];
    const ShellPoint& after = coded->points[i];
    ASSERT_LE((after.p_S - before.p_S).cwiseAbs().maxCoeff(), 1.01 * shell.spacing_m / 512) << i;
    ASSERT_GT(after.normal_S.dot(before.normal_S), std::cos(0.1 * std::numbers::pi / 180)) << i;
  }
  EXPECT_NEAR(coded->area_m2(), shell.area_m2(), 1e-5 * shell.area_m2());
}

TEST(PointShell, EveryNormalIsTheSameWhenCodedAgain) {
  Random random(3);
  std::vector<ShellPoint> points;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 normal = Vec3(random.normal(), random.normal(), i % 4 == 0 ? 0 : random.normal()).normalized();
    points.push_back({Eigen::Vector3f::Zero(), normal.cast<float>(), 1e-7F});
  }
  std::vector<std::uint8_t> first;
  PointShell::in_order(points, 4.5e-4).write(first, 0);
  std::span<const std::uint8_t> rest(first);
  std::vector<std::uint8_t> second;
  PointShell::read(rest, kMaxShapeBytes)->write(second, 0);
  EXPECT_EQ(first, second);
}

TEST(PointShell, RefusesNumbersOutOfRange) {
  const PointShell good = sample_surface(solid(geometry::tessellated_sphere(0.002)), {}, {}).surface;
  std::vector<std::uint8_t> bytes;
  good.write(bytes, 0);
  const auto is_read_with = [&](std::size_t at, std::uint8_t value) {
    std::vector<std::uint8_t> spoilt = bytes;
    spoilt[at] = value;
    std::span<const std::uint8_t> rest(spoilt);
    return PointShell::read(rest, kMaxShapeBytes).has_value();
  };
  EXPECT_TRUE(is_read_with(0, bytes[0]));
  EXPECT_FALSE(is_read_with(7, 0xBF)) << "a negative spacing";
  EXPECT_FALSE(is_read_with(7, 0x7F)) << "an infinite one";
  EXPECT_FALSE(is_read_with(11, 0x7F)) << "two billion points";
  const std::size_t column = 8 + 4 * good.points.size(), head = 12;
  EXPECT_FALSE(is_read_with(head + 3 * column + 8 + 3 * good.points.size(), 0x40)) << "no place on the octahedron";
  EXPECT_FALSE(is_read_with(head + 5 * column + 8, 1)) << "a negative area";
  std::span<const std::uint8_t> rest(bytes);
  EXPECT_FALSE(PointShell::read(rest, sizeof(ShellPoint) * (good.points.size() - 1)).has_value());
}

TEST(PointShell, EndsWhereSinglePrecisionCannotDivideASurface) {
  // A cube far from the origin. At 700 m and at 70 km, the resolution of single precision is 60 µm and 8 mm, so sample
  // points coincide. Fails by not ending if the sampler halves triangles without a limit.
  for (const double distance_m : {700.0, 7e4}) {
    geometry::ContactMesh mesh{geometry::tessellated_box(Vec3::Constant(0.005)), geometry::SurfaceKind::kSolid, {}};
    for (Vec3& vertex : mesh.mesh.vertices) vertex.x() += distance_m;
    const PointShells shells = sample_surface(mesh, {}, {});
    for (const ShellPoint& point : shells.surface.points) ASSERT_TRUE(point.p_S.allFinite());
    EXPECT_LE(shells.surface.points.size(), 500'000U);
  }
}

}  // namespace
}  // namespace tandem::contact
