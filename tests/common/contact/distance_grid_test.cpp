#include "common/contact/field/distance_grid.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/base/random.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/contact/lanes/avx2.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/needs.hpp"

namespace tandem::contact {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::uint64_t kSeed = 5;
/// Resolution of stored distances with the default options: (band + brick diagonal) / 32767
constexpr double kQuantumM = 0.25e-6;
constexpr double kCodedM = 0.94e-6;  ///< largest error of a stored distance, default options: 1/32 of the tolerance

std::unique_ptr<DistanceGrid> grid_of(const geometry::TriangleMesh& mesh, const ContactShapeOptions& options = {},
                                      geometry::SurfaceKind kind = geometry::SurfaceKind::kSolid) {
  return DistanceGrid::build({mesh, kind, {}}, geometry::TriangleTree(mesh), options, {});
}

std::vector<std::uint8_t> bytes_of(const DistanceGrid& grid) {
  std::vector<std::uint8_t> bytes;
  grid.write(bytes, 0);
  return bytes;
}

Vec3 random_point(Random& random, double reach_m) {
  return {random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m)};
}

/// A sphere with bumps and creases. Bricks of all levels of refinement are adjacent in its grid.
geometry::TriangleMesh bumpy_sphere() {
  geometry::TriangleMesh mesh = sphere_mesh(0.008, 5);
  for (Vec3& p : mesh.vertices) {
    const double bump = std::max(0.0, p.x()) / 0.008;
    p *= 1 + 0.03 * bump * bump * std::sin(3000 * p.y()) * std::cos(2000 * p.z());
  }
  return mesh;
}

/// Returns a random point at most `reach_m` from the surface.
Vec3 point_near(const geometry::TriangleMesh& mesh, Random& random, double reach_m) {
  const auto& [a, b, c] = mesh.triangles[random.next_u32() % mesh.triangles.size()];
  const Vec3 at_a = mesh.vertices[static_cast<std::size_t>(a)];
  const Vec3 ab = mesh.vertices[static_cast<std::size_t>(b)] - at_a;
  const Vec3 ac = mesh.vertices[static_cast<std::size_t>(c)] - at_a;
  const double u = random.uniform();
  const double v = random.uniform(0, 1 - u);
  return at_a + u * ab + v * ac + random_point(random, reach_m / std::sqrt(3.0));
}

double signed_distance_to_box_m(const Vec3& p, const Vec3& size_m) {
  const Vec3 beyond = p.cwiseAbs() - 0.5 * size_m;
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

TEST(DistanceGrid, IsRightToItsStatedErrorInTheWholeBand) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  const geometry::TriangleTree tree(mesh);
  const auto grid = grid_of(mesh);
  Random random(kSeed);
  for (const int cells : {4, 8, 16}) EXPECT_GT(grid->brick_count(cells), 5U) << cells;
  EXPECT_LT(grid->error_m(), 1e-4);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = point_near(mesh, random, grid->band_m());
    const double exact = tree.signed_distance_m(p);
    if (std::abs(exact) > grid->band_m()) continue;
    EXPECT_NEAR(grid->distance_m(p), exact, grid->error_m() + kQuantumM) << p.transpose();
    EXPECT_EQ(grid->sample(p).distance_m, grid->distance_m(p));
  }
}

TEST(DistanceGrid, SphereIsTheFormula) {
  // Sagitta kSagM: largest distance of the mesh from the sphere of radius r. It follows in three steps:
  // 1. An edge of a triangle spans the angle α = (π/2)/32.
  // 2. The middle of a triangle is about 0.75 α from its corners.
  // 3. It is therefore r (1 − cos(0.75 α)) = 14 µm below the sphere.
  constexpr double kRadiusM = 0.02;
  constexpr double kSagM = 14e-6;
  const auto grid = grid_of(sphere_mesh(kRadiusM, 5));
  Random random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 out = random_point(random, 1).normalized();
    const double height = random.uniform(-1.5e-3, 1.5e-3);
    const DistanceSample sample = grid->sample((kRadiusM + height) * out);
    EXPECT_NEAR(sample.distance_m, height, kSagM + 2e-5);
    EXPECT_GT(sample.gradient.normalized().dot(out), std::cos(0.06)) << "facets are turned by up to 0.03 rad";
  }
}

TEST(DistanceGrid, FlatFacesAreRightToTheStepOfTheirCoding) {
  const Vec3 size(0.02, 0.015, 0.01);
  const auto grid = grid_of(box_mesh(size));
  Random random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    // Only points more than one brick away from an edge are tested. Bricks around an edge are refined, but this must
    // not make the interpolation on flat faces less accurate.
    const Vec3 p(random.uniform(-0.006, 0.006), random.uniform(-0.003, 0.003), 0.005 + random.uniform(-1.5e-3, 1.5e-3));
    const DistanceSample sample = grid->sample(p);
    EXPECT_NEAR(sample.distance_m, p.z() - 0.005, kCodedM);
    EXPECT_NEAR((sample.gradient - Vec3::UnitZ()).norm(), 0, 4 * kCodedM / grid->coarsest_cell_m());
  }
}

TEST(DistanceGrid, SharpEdgesErrByLessThanHalfTheFinestCell) {
  const Vec3 size(0.02, 0.015, 0.01);
  const geometry::TriangleMesh mesh = box_mesh(size);
  const auto grid = grid_of(mesh);
  Random random(kSeed);
  EXPECT_EQ(grid->finest_cell_m(), 2e-4);
  EXPECT_EQ(grid->coarsest_cell_m(), 8e-4);
  EXPECT_LT(grid->error_m(), 0.5 * grid->finest_cell_m());
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = (Vec3(0.01, 0.0075, random.uniform(-0.005, 0.005)) + random_point(random, 1e-3));
    EXPECT_NEAR(grid->distance_m(p), signed_distance_to_box_m(p, size), 0.5 * grid->finest_cell_m());
  }
}

TEST(DistanceGrid, GradientIsTheSlopeOfTheDistance) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  const auto grid = grid_of(mesh);
  Random random(kSeed);
  constexpr double kStepM = 1e-8;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = point_near(mesh, random, 1e-3);
    const Vec3 gradient = grid->sample(p).gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = kStepM * Vec3::Unit(axis);
      const double slope = (grid->distance_m(p + step) - grid->distance_m(p - step)) / (2 * kStepM);
      EXPECT_NEAR(gradient[axis], slope, 1e-4) << p.transpose();
    }
  }
}

TEST(DistanceGrid, HasNoStepsAcrossBricksOfAnyLevel) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  const auto grid = grid_of(mesh);
  Random random(kSeed);
  constexpr double kStepM = 5e-7;
  int compared = 0;
  for (int line = 0; line < 100; ++line) {
    Vec3 p = point_near(mesh, random, 1e-3);
    const Vec3 step = kStepM * p.cross(random_point(random, 1)).normalized();
    double before = grid->distance_m(p);
    for (int i = 0; i < 10000; ++i) {
      p += step;
      const double after = grid->distance_m(p);
      if (std::max(std::abs(before), std::abs(after)) < grid->band_m()) {
        // The slope of a trilinear interpolant of distances is at most √3. A larger change means a discontinuity
        // between two bricks.
        ASSERT_NEAR(after, before, std::sqrt(3.0) * kStepM + kQuantumM) << p.transpose();
        ++compared;
      }
      before = after;
    }
  }
  EXPECT_GT(compared, 300000);
}

TEST(DistanceGrid, BeyondTheBandItIsNeverFartherThanTheTruth) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  const geometry::TriangleTree tree(mesh);
  const auto grid = grid_of(mesh);
  Random random(kSeed);
  int outside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = random_point(random, 0.025);
    const double exact = tree.signed_distance_m(p);
    const double distance = grid->distance_m(p);
    ASSERT_LE(std::abs(distance), std::abs(exact) + grid->error_m()) << p.transpose();
    if (std::abs(exact) < grid->band_m() + grid->error_m()) continue;
    ASSERT_GE(std::abs(distance), grid->band_m() - grid->error_m()) << p.transpose();
    ASSERT_EQ(distance < 0, exact < 0) << p.transpose();
    ++outside;
  }
  EXPECT_GT(outside, 10000);
}

TEST(DistanceGrid, LooksAheadToTheSurfaceFromAfar) {
  constexpr double kRadiusM = 0.008;
  const auto grid = grid_of(sphere_mesh(kRadiusM, 4));
  Random random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 out = random_point(random, 1).normalized();
    const double height = random.uniform(0, 0.015);
    const DistanceSample sample = grid->sample((kRadiusM + height) * out);
    // Far from the surface, the cells have h = 3.2 mm. At r = 10 mm from the sphere's centre, the interpolation error
    // is 2 h² / (8 r) = 0.26 mm. At the corner of the lattice, it is twice as large.
    EXPECT_NEAR(sample.distance_m, height, 6e-4);
    EXPECT_GT(sample.gradient.normalized().dot(out), std::cos(0.2)) << height;
  }
}

TEST(DistanceGrid, AnswersEveryFinitePointWithAFiniteDirection) {
  const auto grid = grid_of(box_mesh({0.004, 0.004, 0.004}));
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const double reach = std::pow(10.0, random.uniform(-4, 300));
    const Vec3 p = i == 0 ? Vec3(Vec3::Zero()) : random_point(random, reach);
    const DistanceSample sample = grid->sample(p);
    ASSERT_TRUE(std::isfinite(sample.distance_m) && std::isfinite(grid->distance_m(p))) << p.transpose();
    ASSERT_TRUE(is_finite(sample.gradient)) << p.transpose();
    ASSERT_GE(sample.gradient.norm(), 0.0999) << p.transpose();
    ASSERT_LE(sample.gradient.norm(), 2.0) << p.transpose();
  }
}

/// Compares queries of several points with queries of single points: near the surface, deep inside, far outside, in
/// bricks without samples, and at NaN.
TEST(DistanceGrid, AnswersSeveralPlacesAsEachAlone) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  const auto grid = grid_of(mesh);
  Random random(kSeed);
  for (const bool avx2 : {false, uses_avx2()}) {
    const bool before = std::exchange(uses_avx2(), avx2);
    std::size_t near = 0;
    for (std::size_t i = 0; i < 20000; ++i) {
      const std::size_t count = 1 + i % kEight;
      EightPlaces places;
      EightSamples samples;
      for (std::size_t k = 0; k < count; ++k) {
        const double reach_m = std::array{2e-4, 2e-3, 0.01, 0.05}[random.next_u32() % 4];
        Vec3 p = point_near(mesh, random, reach_m);
        if (random.next_u32() % 64 == 0) p.y() = std::numeric_limits<double>::quiet_NaN();
        places.row(static_cast<Eigen::Index>(k)) = p.transpose().array();
      }
      grid->sample_all(places, count, samples);
      EightNumbers distances_m;
      grid->distances_m(places, count, distances_m);
      for (std::size_t k = 0; k < count; ++k) {
        const DistanceSample alone = grid->sample(place_at(places, k));
        const auto row = static_cast<Eigen::Index>(k);
        ASSERT_EQ(samples(row, 0), alone.distance_m) << place_at(places, k).transpose();
        ASSERT_EQ(Vec3(samples.row(row).tail<3>().matrix()), alone.gradient) << place_at(places, k).transpose();
        if (!place_at(places, k).hasNaN()) {
          ASSERT_NEAR(distances_m[k], grid->distance_m(place_at(places, k)), 1e-12) << place_at(places, k).transpose();
        }
        near += std::abs(alone.distance_m) < grid->band_m() ? 1 : 0;
      }
    }
    EXPECT_GT(near, 20000U);
    uses_avx2() = before;
  }
}

TEST(DistanceGrid, SheetIsAPlateThatCanBeTouchedFromBothSides) {
  geometry::TriangleMesh mesh;
  mesh.vertices = {{-0.01, -0.01, 0}, {0.01, -0.01, 0}, {0.01, 0.01, 0}, {-0.01, 0.01, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  ContactShapeOptions options;
  options.sheet_thickness_m = 2e-3;
  const auto grid = grid_of(mesh, options, geometry::SurfaceKind::kSheet);
  Random random(kSeed);
  for (int i = 0; i < 3000; ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    const double height = random.uniform(4e-4, 2.4e-3);
    const DistanceSample sample =
        grid->sample({random.uniform(-0.008, 0.008), random.uniform(-0.008, 0.008), side * height});
    EXPECT_NEAR(sample.distance_m, height - 1e-3, grid->error_m() + kQuantumM);
    EXPECT_GT(sample.gradient.z() * side, 0.9);
  }
  EXPECT_NEAR(grid->distance_m({0.012, 0, 0}), 1e-3, grid->error_m() + kQuantumM) << "its rim is round";
}

TEST(DistanceGrid, ATurnedTriangleDoesNotTurnTheSpaceAboveIt) {
  geometry::TriangleMesh mesh = subdivided(box_mesh({0.02, 0.02, 0.02}), 5);
  for (auto& triangle : mesh.triangles) {
    Vec3 middle = Vec3::Zero();
    for (const int vertex : triangle) middle += mesh.vertices[static_cast<std::size_t>(vertex)] / 3;
    if (middle.z() > 0.0099 && middle.head<2>().norm() < 5e-4) std::swap(triangle[1], triangle[2]);
  }
  const geometry::TriangleTree tree(mesh);
  ASSERT_LT(tree.signed_distance_m({1e-4, 2e-4, 0.0105}), 0) << "pseudo-normals alone are deceived";
  const auto grid = grid_of(mesh);
  Random random(kSeed);
  for (int i = 0; i < 3000; ++i) {
    const Vec3 p(random.uniform(-1e-3, 1e-3), random.uniform(-1e-3, 1e-3), 0.01 + random.uniform(-4e-3, 8e-3));
    const double height = p.z() - 0.01;
    if (std::abs(height) < 3e-4) continue;
    EXPECT_EQ(grid->sample(p).distance_m < 0, height < 0) << p.transpose();
  }
}

TEST(DistanceGrid, BunnyIsRightToItsStatedError) {
  // The bunny is smaller and the tolerance larger than by default, because sampling takes seconds. This test is only
  // about the flaws of a scanned mesh.
  TANDEM_NEEDS_FILES(kBunnyFile);
  const geometry::TriangleMesh bunny = bunny_mesh(0.02);
  const geometry::TriangleTree tree(bunny);
  ContactShapeOptions options;
  options.tolerance_m = 5e-5;
  const auto grid = grid_of(bunny, options);
  Random random(kSeed);
  int wrong = 0;
  for (int i = 0; i < 10000; ++i) {
    const Vec3 p = point_near(bunny, random, grid->band_m());
    const double exact = tree.signed_distance_m(p);
    if (std::abs(exact) > grid->band_m()) continue;
    wrong += std::abs(grid->distance_m(p) - exact) > grid->error_m() ? 1 : 0;
  }
  EXPECT_LE(wrong, 10) << "only above folds of the mesh, where the tree's sign is noise";
  EXPECT_LE(grid->error_m(), std::sqrt(0.75) * grid->finest_cell_m());
  EXPECT_LE(grid->coarsest_cell_m(), 8e-4);
}

TEST(DistanceGrid, AGridThatWouldBeTooLargeGetsLargerCells) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  const auto whole = grid_of(mesh);
  ContactShapeOptions options;
  options.max_grid_bytes = whole->memory_bytes() / 3;
  const auto smaller = grid_of(mesh, options);
  EXPECT_LT(static_cast<double>(smaller->memory_bytes()), 1.2 * static_cast<double>(options.max_grid_bytes));
  EXPECT_GT(smaller->memory_bytes(), options.max_grid_bytes / 4) << "no coarser than it must be";
  EXPECT_GT(smaller->coarsest_cell_m(), whole->coarsest_cell_m());
  EXPECT_GT(smaller->error_m(), whole->error_m());
  for (const Vec3& p : mesh.vertices) EXPECT_NEAR(smaller->sample(p).distance_m, 0, 2 * smaller->error_m());
}

TEST(DistanceGrid, IsTheSameForAnyNumberOfThreads) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  ContactShapeOptions options;
  options.threads = 1;
  const std::vector<std::uint8_t> alone = bytes_of(*grid_of(mesh, options));
  options.threads = 3;
  EXPECT_EQ(bytes_of(*grid_of(mesh, options)), alone);
}

TEST(DistanceGrid, ProgressRisesToOneOnTheCallingThread) {
  const geometry::TriangleMesh mesh = sphere_mesh(0.005, 3);
  std::vector<double> reported;
  const auto caller = std::this_thread::get_id();
  DistanceGrid::build({mesh, geometry::SurfaceKind::kSolid, {}}, geometry::TriangleTree(mesh), {}, [&](double done) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    reported.push_back(done);
  });
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  ASSERT_FALSE(reported.empty());
  EXPECT_GE(reported.front(), 0);
  EXPECT_EQ(reported.back(), 1.0);
}

TEST(DistanceGrid, AThrowOfProgressEndsTheBuild) {
  const geometry::TriangleMesh mesh = sphere_mesh(0.005, 3);
  const auto cancel = [](double) { throw std::runtime_error("cancelled"); };
  EXPECT_THAT(
      [&] {
        DistanceGrid::build({mesh, geometry::SurfaceKind::kSolid, {}}, geometry::TriangleTree(mesh), {}, cancel);
      },
      ThrowsMessage<std::runtime_error>("cancelled"));
}

TEST(DistanceGrid, ReadsTheGridThatItWrote) {
  const geometry::TriangleMesh mesh = bumpy_sphere();
  const auto grid = grid_of(mesh);
  std::vector<std::uint8_t> bytes = bytes_of(*grid);
  bytes.push_back(42);
  std::span<const std::uint8_t> rest = bytes;
  const auto copy = DistanceGrid::read(rest, kMaxShapeBytes);
  ASSERT_NE(copy, nullptr);
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(bytes_of(*copy), bytes_of(*grid));
  EXPECT_EQ(copy->finest_cell_m(), grid->finest_cell_m());
  EXPECT_EQ(copy->coarsest_cell_m(), grid->coarsest_cell_m());
  Random random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random_point(random, 0.015);
    EXPECT_EQ(copy->distance_m(p), grid->distance_m(p));
    EXPECT_EQ(copy->sample(p).gradient, grid->sample(p).gradient);
  }
}

TEST(DistanceGrid, CutBytesAreNoGrid) {
  const std::vector<std::uint8_t> bytes = bytes_of(*grid_of(box_mesh({0.004, 0.004, 0.004})));
  for (std::size_t size = 0; size < bytes.size(); size += size < 300 ? 1 : 997) {
    std::span<const std::uint8_t> cut(bytes.data(), size);
    EXPECT_EQ(DistanceGrid::read(cut, kMaxShapeBytes), nullptr) << size;
  }
}

TEST(DistanceGrid, DamagedBytesAreRefusedOrGiveFiniteDistances) {
  const std::vector<std::uint8_t> bytes = bytes_of(*grid_of(box_mesh({0.004, 0.004, 0.004})));
  Random random(kSeed);
  int read = 0;
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::uint8_t> spoilt = bytes;
    // In half of the rounds, only the header is damaged, because damage has the largest effect in the header.
    const std::size_t reach = round % 2 == 0 ? 120 : spoilt.size();
    for (int i = 0; i < 3; ++i) spoilt[random.next_u32() % reach] = static_cast<std::uint8_t>(random.next_u32());
    std::span<const std::uint8_t> rest = spoilt;
    const auto grid = DistanceGrid::read(rest, kMaxShapeBytes);
    if (grid == nullptr) continue;
    ++read;
    for (int i = 0; i < 20; ++i) {
      const Vec3 p = random_point(random, 0.01);
      const DistanceSample sample = grid->sample(p);
      ASSERT_TRUE(std::isfinite(sample.distance_m) && std::isfinite(grid->distance_m(p))) << "round " << round;
      ASSERT_TRUE(is_finite(sample.gradient) && sample.gradient.norm() > 0.09) << "round " << round;
      ASSERT_LE(sample.gradient.norm(), 2.001) << "round " << round;
    }
  }
  EXPECT_GT(read, 100) << "seed " << kSeed;
}

TEST(DistanceGrid, HugeCountsAreRefusedBeforeMemoryIsTaken) {
  std::vector<std::uint8_t> bytes = bytes_of(*grid_of(box_mesh({0.004, 0.004, 0.004})));
  const std::uint64_t before = test::allocation_count();
  for (std::size_t first = 0; first < 12; first += 4) {
    std::vector<std::uint8_t> huge = bytes;
    for (std::size_t i = 0; i < 4; ++i) huge[first + i] = i == 3 ? 0x3F : 0xFF;
    std::span<const std::uint8_t> rest = huge;
    EXPECT_EQ(DistanceGrid::read(rest, kMaxShapeBytes), nullptr);
  }
  EXPECT_LE(test::allocation_count() - before, 8U) << "the bytes and the object only";
}

TEST(DistanceGrid, AQueryAllocatesNothing) {
  const auto grid = grid_of(box_mesh({0.004, 0.004, 0.004}));
  Random random(kSeed);
  const std::uint64_t before = test::allocation_count();
  double sum = 0;
  for (int i = 0; i < 100; ++i) {
    const Vec3 p = random_point(random, 0.02);
    sum += grid->distance_m(p) + grid->sample(p).distance_m;
  }
  EXPECT_EQ(test::allocation_count(), before) << sum;
}

TEST(DistanceGrid, NamesTheOptionThatIsOutOfItsRange) {
  const auto build_with = [](double ContactShapeOptions::*option, double value) {
    return [=] {
      ContactShapeOptions options;
      options.*option = value;
      grid_of(box_mesh({0.004, 0.004, 0.004}), options);
    };
  };
  const auto names = [](const char* what) { return ThrowsMessage<std::invalid_argument>(HasSubstr(what)); };
  EXPECT_THAT(build_with(&ContactShapeOptions::cell_m, 0), names("cell_m"));
  EXPECT_THAT(build_with(&ContactShapeOptions::tolerance_m, std::nan("")), names("tolerance_m"));
  EXPECT_THAT(build_with(&ContactShapeOptions::band_m, 1e-4), names("band_m"));
  EXPECT_THAT(build_with(&ContactShapeOptions::sheet_thickness_m, -1), names("sheet_thickness_m"));
}

TEST(DistanceGrid, AMeshInMillimetresIsNotTakenForMetres) {
  EXPECT_THAT(
      [] {
        grid_of(box_mesh({50, 40, 30}));
      },
      ThrowsMessage<geometry::MeshError>(HasSubstr("is its unit metres?")));
}

TEST(DistanceGrid, APositionThatIsNotANumberIsFarAway) {
  const geometry::ContactMesh mesh{box_mesh(Vec3::Constant(0.01)), geometry::SurfaceKind::kSolid, {}};
  const auto grid = DistanceGrid::build(mesh, geometry::TriangleTree(mesh.mesh), {}, {});
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 p = Vec3::Zero();
    p[axis] = std::numeric_limits<double>::quiet_NaN();
    const DistanceSample sample = grid->sample(p);
    EXPECT_GT(sample.distance_m, 1.0);
    EXPECT_TRUE(std::isfinite(sample.distance_m));
    EXPECT_EQ(sample.gradient.norm(), 1.0);
  }
}

// The mesh consists of two boxes that intersect, with a sheet beside them. Building its grid and points uses all
// functions with threads: the union of solids, the classification of regions, and the removal of interior points.
TEST(DistanceGrid, AndPointsOfAMeshAreTheSameByAnyNumberOfThreads) {
  geometry::TriangleMesh sheet;
  sheet.vertices = {{0.02, 0, 0}, {0.03, 0, 0}, {0.02, 0.01, 0}};
  sheet.triangles = {{0, 1, 2}};
  const geometry::TriangleMesh crossing =
      geometry::joined(box_mesh({0.03, 0.006, 0.006}), box_mesh({0.006, 0.03, 0.005}, {0.002, 0.001, 0.0003}));
  const geometry::ContactMesh parts{crossing, geometry::SurfaceKind::kSolid, {}, sheet};
  ContactShapeOptions options;
  options.threads = 1;
  const std::vector<std::uint8_t> by_one = contact_asset_bytes(*make_contact_mesh(parts, options), 0);
  for (const int threads : {2, 3}) {
    options.threads = threads;
    EXPECT_EQ(contact_asset_bytes(*make_contact_mesh(parts, options), 0), by_one) << threads;
  }
}

}  // namespace
}  // namespace tandem::contact
