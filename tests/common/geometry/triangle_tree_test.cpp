#include "common/geometry/triangle_tree.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>

#include "common/base/random.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/tessellation.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/needs.hpp"

namespace tandem::geometry {
namespace {

constexpr std::uint64_t kTriangleTreeSeed = 11;

double distance_to_segment_m(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - along * (b - a)).norm();
}

/// Returns the distance to a triangle, by another algorithm than the tree. If the foot of the perpendicular is inside
/// all three sides, the distance is the height above the plane. Otherwise it is the distance to the nearest side.
double distance_to_triangle_m(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = (b - a).cross(c - a).normalized();
  const auto is_inside = [&](const Vec3& from, const Vec3& to) { return normal.cross(to - from).dot(p - from) >= 0; };
  if (is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) return std::abs(normal.dot(p - a));
  return std::min({distance_to_segment_m(p, a, b), distance_to_segment_m(p, b, c), distance_to_segment_m(p, c, a)});
}

double distance_by_trying_all_m(const TriangleMesh& mesh, const Vec3& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto vertex = [&](int i) { return mesh.vertices[static_cast<std::size_t>(i)]; };
    nearest = std::min(nearest, distance_to_triangle_m(p, vertex(a), vertex(b), vertex(c)));
  }
  return nearest;
}

/// Returns the winding number of the surface around a point: 1 inside, 0 outside.
///
/// Source  van Oosterom & Strackee, "The solid angle of a plane triangle", 1983
double winding_number(const TriangleMesh& mesh, const Vec3& p) {
  double sum = 0;
  for (const auto& triangle : mesh.triangles) {
    const Vec3 a = mesh.vertices[static_cast<std::size_t>(triangle[0])] - p;
    const Vec3 b = mesh.vertices[static_cast<std::size_t>(triangle[1])] - p;
    const Vec3 c = mesh.vertices[static_cast<std::size_t>(triangle[2])] - p;
    const double product = a.norm() * b.norm() * c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), product + a.dot(b) * c.norm() + b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return sum / (4 * std::numbers::pi);
}

Vec3 random_place(Random& random, double reach_m) {
  return {random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m)};
}

TriangleMesh rough_sphere(Random& random) {
  TriangleMesh mesh = contact::sphere_mesh(0.02, 4);
  for (Vec3& vertex : mesh.vertices) vertex += random_place(random, 3e-4);
  return mesh;
}

double distance_to_box_m(const Vec3& p, const Vec3& size_m) {
  const Vec3 beyond = p.cwiseAbs() - 0.5 * size_m;
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

TEST(TriangleTree, FindsTheDistanceThatTryingEveryTriangleFinds) {
  Random random(kTriangleTreeSeed);
  const TriangleMesh mesh = rough_sphere(random);
  const TriangleTree tree(mesh);
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = random_place(random, 0.03);
    const TriangleTree::Closest closest = tree.closest(p);
    EXPECT_NEAR(closest.distance_m, distance_by_trying_all_m(mesh, p), 1e-15) << p.transpose();
    EXPECT_NEAR((p - closest.point_S).norm(), closest.distance_m, 1e-15);
  }
}

// The tree stores boxes and discs in single precision. Far from the origin, their rounding errors must not hide a
// triangle.
TEST(TriangleTree, FindsThatFarFromTheOriginAndFromFarAwayToo) {
  Random random(kTriangleTreeSeed);
  TriangleMesh mesh = rough_sphere(random);
  const Vec3 moved(300.1, -20.7, 0.9);
  for (Vec3& vertex : mesh.vertices) vertex = moved + vertex.cwiseProduct(Vec3(1, 1, 1e-4));
  const TriangleTree tree(mesh);
  for (int i = 0; i < 400; ++i) {
    const double reach_m = i < 200 ? 0.03 : std::pow(10, random.uniform(-1, 5));
    const Vec3 p = moved + random_place(random, reach_m);
    const double expected_m = distance_by_trying_all_m(mesh, p);
    EXPECT_NEAR(tree.closest(p).distance_m, expected_m, 1e-12 + 1e-14 * reach_m) << p.transpose();
  }
  EXPECT_EQ(tree.closest(Vec3(0, std::nan(""), 0)).triangle, -1);
  EXPECT_GE(tree.closest(Vec3(1e100, 0, 0)).triangle, 0);
  EXPECT_EQ(tree.closest(Vec3(1e200, 0, 0)).triangle, -1) << "no number says how far that is";
}

// Near the centre of a ball, all triangles have almost the same distance. The differences are below the resolution of
// single precision. The tree must find the nearest triangle nevertheless.
TEST(TriangleTree, FindsTheNearestOfManyThatAreNearlyAsNear) {
  Random random(kTriangleTreeSeed);
  for (const double radius_m : {1e-3, 0.02, 1.0}) {
    const TriangleMesh mesh = contact::sphere_mesh(radius_m, 4);
    const TriangleTree tree(mesh);
    for (int i = 0; i < 300; ++i) {
      const Vec3 p = random_place(random, 1e-4 * radius_m);
      EXPECT_NEAR(tree.closest(p).distance_m, distance_by_trying_all_m(mesh, p), 1e-14 * radius_m) << p.transpose();
    }
  }
}

TEST(TriangleTree, AHintChangesTheCostNotTheDistance) {
  Random random(kTriangleTreeSeed);
  const TriangleMesh mesh = rough_sphere(random);
  const TriangleTree tree(mesh);
  const auto count = static_cast<int>(tree.triangle_count());
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = random_place(random, 0.03);
    const double distance = tree.closest(p).distance_m;
    for (const int hint : {static_cast<int>(random.next_u32() % mesh.triangles.size()), 0, count, -7}) {
      EXPECT_NEAR(tree.closest(p, 1.0, hint).distance_m, distance, 1e-15);
    }
  }
}

TEST(TriangleTree, FindsNothingBeyondTheLimit) {
  const TriangleTree tree(contact::box_mesh({0.02, 0.02, 0.02}));
  const Vec3 p(0.015, 0, 0);
  EXPECT_EQ(tree.closest(p, 0.0049).triangle, -1);
  EXPECT_TRUE(std::isinf(tree.closest(p, 0.0049, 3).distance_m));
  EXPECT_NEAR(tree.closest(p, 0.0051).distance_m, 0.005, 1e-15);
}

/// Checks that `query` finds the expected triangles. The query fills a span and returns the number of triangles found.
/// If the span is too short, the returned number must exceed the size of the span.
template <class Query>
std::size_t expect_finds(const std::vector<int>& expected, std::span<TriangleTree::Near> found, const Query& query) {
  const std::size_t count = query(found);
  std::vector<int> triangles;
  for (std::size_t k = 0; k < count; ++k) triangles.push_back(found[k].triangle);
  EXPECT_THAT(triangles, testing::UnorderedElementsAreArray(expected));
  if (count > 1) {
    EXPECT_GT(query(found.first(count - 1)), count - 1);
  }
  return count;
}

TEST(TriangleTree, FindsAllTrianglesWithinADistanceAndReportsAFullList) {
  Random random(kTriangleTreeSeed);
  const TriangleMesh mesh = rough_sphere(random);
  const TriangleTree tree(mesh);
  std::vector<TriangleTree::Near> found(mesh.triangles.size());
  for (int i = 0; i < 100; ++i) {
    const Vec3 p = random_place(random, 0.025);
    const double limit = random.uniform(1e-3, 0.02);
    std::vector<int> expected;
    for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
      const auto corner = [&](std::size_t at) {
        return mesh.vertices[static_cast<std::size_t>(mesh.triangles[k][at])];
      };
      if (distance_to_triangle_m(p, corner(0), corner(1), corner(2)) <= limit) expected.push_back(static_cast<int>(k));
    }
    const std::size_t count =
        expect_finds(expected, found, [&](std::span<TriangleTree::Near> into) { return tree.within(p, limit, into); });
    for (std::size_t k = 0; k < count; ++k) {
      const auto& corners = mesh.triangles[static_cast<std::size_t>(found[k].triangle)];
      EXPECT_EQ(found[k].a, mesh.vertices[static_cast<std::size_t>(corners[0])]);
    }
  }
}

/// Returns true if a line crosses a triangle. The test compares the tree with this function. It projects the triangle
/// onto the plane perpendicular to the line, and tests on which side of each edge the line is.
bool is_crossed(const TriangleMesh& mesh, std::size_t triangle, const Vec3& p, const Vec3& along) {
  const Vec3 right = along.unitOrthogonal(), up = along.cross(right);
  std::array<double, 3> turns{};
  for (std::size_t side = 0; side < 3; ++side) {
    const Vec3 a = mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][side])] - p;
    const Vec3 b = mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][(side + 1) % 3])] - p;
    turns[side] = a.dot(right) * b.dot(up) - a.dot(up) * b.dot(right);
  }
  return std::ranges::all_of(turns, [](double t) { return t > 0; }) ||
         std::ranges::all_of(turns, [](double t) { return t < 0; });
}

TEST(TriangleTree, FindsAllTrianglesThatALineCrossesAndReportsAFullList) {
  Random random(kTriangleTreeSeed);
  const TriangleMesh mesh = rough_sphere(random);
  const TriangleTree tree(mesh);
  std::vector<TriangleTree::Near> found(mesh.triangles.size());
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = random_place(random, 0.025);
    const Vec3 along = i < 3 ? Vec3::Unit(i) : random_place(random, 1).normalized();
    std::vector<int> expected;
    for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
      if (is_crossed(mesh, k, p, along)) expected.push_back(static_cast<int>(k));
    }
    const std::size_t count =
        expect_finds(expected, found, [&](std::span<TriangleTree::Near> into) { return tree.crossed(p, along, into); });
    EXPECT_EQ(count % 2, 0U) << "a line crosses a closed surface an even number of times";
  }
}

TEST(TriangleTree, SignedDistanceToABoxIsTheFormula) {
  Random random(kTriangleTreeSeed);
  const Vec3 size(0.02, 0.03, 0.05);
  const TriangleTree tree(contact::subdivided(contact::box_mesh(size), 2));
  for (int i = 0; i < 3000; ++i) {
    const Vec3 p = random_place(random, 0.04);
    EXPECT_NEAR(tree.signed_distance_m(p), distance_to_box_m(p, size), 1e-15) << p.transpose();
  }
}

TEST(TriangleTree, NormalsAtCornersDoNotDependOnHowFacesAreCut) {
  const Vec3 size(0.02, 0.03, 0.05);
  const TriangleTree tree(contact::box_mesh(size));
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 out = Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1) / std::sqrt(3.0);
    const TriangleTree::Closest closest = tree.closest(1.1 * out.cwiseProduct(size));
    EXPECT_NEAR(closest.normal_S.normalized().dot(out), 1.0, 1e-12) << corner;
  }
}

TEST(TriangleTree, InsideOfTheBunnyIsWhereItWindsAroundAPoint) {
  TANDEM_NEEDS_FILES(contact::kBunnyFile);
  const TriangleMesh bunny = contact::bunny_mesh(0.1);
  const TriangleTree tree(bunny);
  Random random(kTriangleTreeSeed);
  int inside = 0;
  for (int i = 0; i < 100; ++i) {
    const std::size_t vertex = random.next_u32() % bunny.vertices.size();
    const Vec3 p = bunny.vertices[vertex] + random_place(random, 2e-3);
    const double distance = tree.signed_distance_m(p);
    EXPECT_EQ(distance<0, winding_number(bunny, p)> 0.5) << p.transpose() << ", distance " << distance;
    inside += distance < 0 ? 1 : 0;
  }
  EXPECT_GT(inside, 20);
}

TEST(TriangleTree, TrianglesWithoutAreaDoNotSpoilTheRest) {
  TriangleMesh mesh = contact::box_mesh({0.02, 0.02, 0.02});
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({2, 2, 2});
  const TriangleTree tree(mesh);
  Random random(kTriangleTreeSeed);
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = random_place(random, 0.03);
    EXPECT_NEAR(tree.closest(p).distance_m, std::abs(distance_to_box_m(p, {0.02, 0.02, 0.02})), 1e-15);
  }
}

TEST(TriangleTree, ManyTrianglesInOnePlaceAreNoDeepTree) {
  TriangleMesh mesh = contact::box_mesh({0.02, 0.02, 0.02});
  for (int i = 0; i < 20000; ++i) mesh.triangles.push_back(mesh.triangles[0]);
  EXPECT_NEAR(TriangleTree(mesh).closest(Vec3(0.03, 0, 0)).distance_m, 0.02, 1e-15);
}

TEST(TriangleTree, RefusesAMeshWithoutTriangles) {
  EXPECT_THROW(TriangleTree{TriangleMesh{}}, std::invalid_argument);
}

TEST(TriangleTree, AQueryAllocatesNothing) {
  const TriangleTree tree(contact::sphere_mesh(0.02, 4));
  Random random(kTriangleTreeSeed);
  const std::uint64_t before = test::allocation_count();
  double sum = 0;
  for (int i = 0; i < 100; ++i) sum += tree.signed_distance_m(random_place(random, 0.03));
  EXPECT_EQ(test::allocation_count(), before) << sum;
}

/// Adds an axis-aligned box. If `flipped`, its triangles face inwards.
void add_box(TriangleMesh& mesh, const Vec3& centre, const Vec3& size_m, bool flipped = false) {
  const TriangleMesh box = tessellated_box(size_m);
  const int first = static_cast<int>(mesh.vertices.size());
  for (const Vec3& vertex : box.vertices) mesh.vertices.push_back(vertex + centre);
  for (const auto& [a, b, c] : box.triangles) {
    mesh.triangles.push_back({first + a, first + (flipped ? c : b), first + (flipped ? b : c)});
  }
}

// The mesh is a cross of two bars (no corner of one bar is inside the other), a post through both, and a separate bar.
TEST(TriangleTree, SolidsThatOverlapAreTheirUnion) {
  const std::array<std::array<Vec3, 2>, 4> boxes{{{Vec3(0, 0, 0), Vec3(0.1, 0.02, 0.02)},
                                                  {Vec3(0.01, 0, 0.001), Vec3(0.02, 0.1, 0.014)},
                                                  {Vec3(0.01, 0, 0), Vec3(0.008, 0.008, 0.08)},
                                                  {Vec3(0.03, 0.04, 0), Vec3(0.01, 0.01, 0.01)}}};
  TriangleMesh mesh;
  for (const auto& [centre, size_m] : boxes) add_box(mesh, centre, size_m);
  const TriangleTree tree = TriangleTree::of_solid(mesh, {});
  EXPECT_TRUE(tree.may_overlap());
  Random random(kTriangleTreeSeed);
  int inside = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = random_place(random, 0.03);
    double expected_m = std::numeric_limits<double>::infinity();
    for (const auto& [centre, size_m] : boxes) expected_m = std::min(expected_m, distance_to_box_m(p - centre, size_m));
    inside += expected_m < 0 ? 1 : 0;
    ASSERT_NEAR(tree.signed_distance_m(p), expected_m, 1e-12) << p.transpose();
    const TriangleTree::Closest closest = tree.closest_of_solid(p, 0.004);
    ASSERT_EQ(closest.triangle >= 0, std::abs(expected_m) < 0.004) << p.transpose();
  }
  EXPECT_GT(inside, 500);
}

// A hollow box contains another box in its cavity. The inner box protrudes through the wall into the outside.
TEST(TriangleTree, AnInsideOutSurfaceIsACavity) {
  TriangleMesh mesh;
  add_box(mesh, Vec3::Zero(), Vec3::Constant(0.06));
  add_box(mesh, Vec3::Zero(), Vec3::Constant(0.04), true);
  add_box(mesh, Vec3(0.02, 0, 0), Vec3(0.03, 0.01, 0.01));
  const TriangleTree tree = TriangleTree::of_solid(mesh, {});
  Random random(kTriangleTreeSeed);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = random_place(random, 0.04);
    const double hollow_m =
        std::max(distance_to_box_m(p, Vec3::Constant(0.06)), -distance_to_box_m(p, Vec3::Constant(0.04)));
    const double bar_m = distance_to_box_m(p - Vec3(0.02, 0, 0), Vec3(0.03, 0.01, 0.01));
    ASSERT_NEAR(tree.signed_distance_m(p), std::min(hollow_m, bar_m), 1e-12) << p.transpose();
  }
}

/// Returns a bar of square section along a path in the plane z = 0 with right-angled turns. The ends of the bar are
/// closed.
TriangleMesh bent_bar(const std::vector<Vec3>& way, double half_m) {
  TriangleMesh mesh;
  const auto left = [&](std::size_t from) { return Vec3(Vec3::UnitZ().cross(way[from + 1] - way[from]).normalized()); };
  for (std::size_t i = 0; i < way.size(); ++i) {
    const bool turns = i > 0 && i + 1 < way.size();
    const Vec3 aside = turns ? Vec3(left(i - 1) + left(i)) : left(i == 0 ? 0 : i - 1);
    for (const auto& [along, up] : {std::pair(1, 1), std::pair(-1, 1), std::pair(-1, -1), std::pair(1, -1)}) {
      mesh.vertices.push_back(way[i] + half_m * (along * aside + up * Vec3::UnitZ()));
    }
    if (i == 0) continue;
    const int ring = 4 * static_cast<int>(i);
    for (int k = 0; k < 4; ++k) {
      const int next = (k + 1) % 4;
      mesh.triangles.push_back({ring - 4 + k, ring - 4 + next, ring + next});
      mesh.triangles.push_back({ring - 4 + k, ring + next, ring + k});
    }
  }
  const int last = 4 * static_cast<int>(way.size() - 1);
  mesh.triangles.insert(mesh.triangles.end(),
                        {{0, 2, 1}, {0, 3, 2}, {last, last + 1, last + 2}, {last, last + 2, last + 3}});
  return mesh;
}

// A bar passes through itself, as a coarse and as a fine mesh. In the coarse mesh, each triangle crosses another one.
// In the fine mesh, some triangles cross no others; the tree classifies whole regions of them at once.
TEST(TriangleTree, APartThatGoesThroughItselfIsSolidThere) {
  constexpr double kHalf_m = 0.004;
  const std::vector<Vec3> way{{-0.03, 0, 0}, {0.03, 0, 0}, {0.03, 0.03, 0}, {0, 0.03, 0}, {0, -0.03, 0}};
  for (const int times : {0, 4}) {
    const ContactMesh mesh = repaired(contact::subdivided(bent_bar(way, kHalf_m), times));
    const TriangleTree tree = TriangleTree::of_solid(mesh.mesh, mesh.inner);
    const TriangleTree of_three = TriangleTree::of_solid(mesh.mesh, mesh.inner, 3);
    EXPECT_TRUE(tree.may_overlap());
    Random random(kTriangleTreeSeed);
    int inside = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 p = random_place(random, 0.035).cwiseProduct(Vec3(1, 1, 0.3));
      double expected_m = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k + 1 < way.size(); ++k) {
        // Reference: the distance to the nearest straight piece of the bar. At a turn, a piece is longer by half the
        // bar's width.
        const Vec3 along = (way[k + 1] - way[k]).normalized();
        const Vec3 from = way[k] - (k > 0 ? kHalf_m : 0) * along;
        const Vec3 to = way[k + 1] + (k + 2 < way.size() ? kHalf_m : 0) * along;
        const Vec3 size_m = (to - from).cwiseAbs() + 2 * kHalf_m * (Vec3::Ones() - along.cwiseAbs());
        expected_m = std::min(expected_m, distance_to_box_m(p - (from + to) / 2, size_m));
      }
      inside += expected_m < 0 ? 1 : 0;
      const double found_m = tree.signed_distance_m(p);
      ASSERT_EQ(of_three.signed_distance_m(p), found_m);
      ASSERT_EQ(found_m < 0, expected_m < 0) << p.transpose() << ", divided " << times << " times";
      if (expected_m <= 0) continue;
      ASSERT_NEAR(found_m, expected_m, 1e-12) << p.transpose();
    }
    EXPECT_GT(inside, 1000);
  }
}

// A bar passes through a block; the midpoint of each side of the bar is inside the block. Each part contains a wall, so
// the winding number classifies its triangles. A classification by midpoints alone would remove the bar.
TEST(TriangleTree, APartThatExtendsFromASolidCountsThere) {
  const Vec3 block_m(0.06, 0.04, 0.04), bar_m(0.006, 0.08, 0.01), bar_at(0.011, 0.001, 0.002);
  TriangleMesh mesh;
  add_box(mesh, Vec3::Zero(), block_m);
  const int first = static_cast<int>(mesh.vertices.size());
  add_box(mesh, bar_at, bar_m);
  mesh.triangles.insert(mesh.triangles.end(), {{0, 1, 7}, {first, first + 1, first + 7}});
  const ContactMesh result = repaired(mesh);
  EXPECT_EQ(result.parts.at(0).why, "enclosed, by the winding number");
  const TriangleTree tree = TriangleTree::of_solid(result.mesh, result.inner);
  Random random(kTriangleTreeSeed);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = random_place(random, 0.05);
    const double expected_m = std::min(distance_to_box_m(p, block_m), distance_to_box_m(p - bar_at, bar_m));
    const double found_m = tree.signed_distance_m(p);
    ASSERT_EQ(found_m < 0, expected_m < 0) << p.transpose();
    if (expected_m <= 0) continue;
    ASSERT_NEAR(found_m, expected_m, 1e-9) << p.transpose();
  }
}

TEST(TriangleTree, PartsThatAreApartAreOneSurface) {
  TriangleMesh mesh;
  add_box(mesh, Vec3::Zero(), Vec3::Constant(0.02));
  add_box(mesh, Vec3(0.03, 0, 0), Vec3::Constant(0.02));
  EXPECT_FALSE(TriangleTree::of_solid(mesh, {}).may_overlap());
}

}  // namespace
}  // namespace tandem::geometry
