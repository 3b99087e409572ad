// Tests distances to solids that overlap, intersect themselves or have unpaired edges. An independent reference sums
// solid angles and tests all triangles, without a tree.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/contact/field/distance_grid.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"
#include "tests/common/contact/mesh_measures.hpp"
#include "tests/common/contact/test_meshes.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::contact {
namespace {

using geometry::TriangleMesh;
using geometry::TriangleTree;
using Triangle = std::array<Vec3, 3>;

std::vector<Triangle> triangles_of(const TriangleMesh& mesh) {
  std::vector<Triangle> triangles;
  const auto at = [&](int vertex) { return mesh.vertices[static_cast<std::size_t>(vertex)]; };
  for (const auto& [a, b, c] : mesh.triangles) triangles.push_back({at(a), at(b), at(c)});
  return triangles;
}

/// Returns the winding number of a point, the sum of the solid angles of all triangles divided by 4π.
///
/// Source  van Oosterom & Strackee, "The solid angle of a plane triangle", 1983
double winding_number(const std::vector<Triangle>& surface, const Vec3& p) {
  double sum = 0;
  for (const Triangle& triangle : surface) {
    const Vec3 a = triangle[0] - p, b = triangle[1] - p, c = triangle[2] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

double distance_to_segment_m(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - along * (b - a)).norm();
}

double distance_to_triangle_m(const Triangle& triangle, const Vec3& p) {
  const auto& [a, b, c] = triangle;
  const Vec3 normal = (b - a).cross(c - a).normalized();
  const auto is_inside = [&](const Vec3& from, const Vec3& to) { return normal.cross(to - from).dot(p - from) >= 0; };
  if (is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) return std::abs(normal.dot(p - a));
  return std::min({distance_to_segment_m(p, a, b), distance_to_segment_m(p, b, c), distance_to_segment_m(p, c, a)});
}

/// Returns true if the segment from `p` to `q` crosses the triangle. Its ends are then on different sides of the
/// triangle, and it passes all three edges in the same sense of rotation.
bool pierces(const Vec3& p, const Vec3& q, const Triangle& t) {
  constexpr double kRounding = 1e-18;
  const auto volume = [](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    return (b - a).cross(c - a).dot(d - a);
  };
  const double at_p = volume(t[0], t[1], t[2], p), at_q = volume(t[0], t[1], t[2], q);
  if (!(std::min(at_p, at_q) < -kRounding && std::max(at_p, at_q) > kRounding)) return false;
  const double sides[] = {volume(p, q, t[0], t[1]), volume(p, q, t[1], t[2]), volume(p, q, t[2], t[0])};
  const auto [least, most] = std::minmax({sides[0], sides[1], sides[2]});
  return least > -kRounding || most < kRounding;
}

bool cross(const Triangle& a, const Triangle& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (pierces(a[i], a[(i + 1) % 3], b) || pierces(b[i], b[(i + 1) % 3], a)) return true;
  }
  return false;
}

struct Range {
  double least_m = std::numeric_limits<double>::infinity();
  double most_m = std::numeric_limits<double>::infinity();
};

/// Reference for one closed or nearly closed surface.
/// - A point is inside if its winding number is above ½.
/// - A triangle belongs to the border unless both of its sides are inside.
/// - Triangles that cross others are divided into small pieces. The distance to the border is therefore a range: from
///   the nearest piece that may belong to the border to the nearest piece that certainly does.
class Judge {
 public:
  explicit Judge(const TriangleMesh& mesh) : surface_(triangles_of(mesh)) {
    for (const Triangle& triangle : surface_) divide(triangle, surface_);
  }

  double winding(const Vec3& p) const { return winding_number(surface_, p); }
  Range to_border(const Vec3& p) const {
    Range range;
    for (const Piece& piece : pieces_) {
      if ((p - piece.middle).norm() - piece.radius_m >= range.most_m) continue;
      const double distance_m = distance_to_triangle_m(piece.triangle, p);
      range.least_m = std::min(range.least_m, distance_m);
      if (piece.is_whole) range.most_m = std::min(range.most_m, distance_m);
    }
    return range;
  }
  Vec3 on_border(Random& random) const {
    const auto& [a, b, c] = pieces_[random.next_u32() % pieces_.size()].triangle;
    const double u = random.uniform(), v = random.uniform(0, 1 - u);
    return a + u * (b - a) + v * (c - a);
  }
  bool is_divided() const { return !std::ranges::all_of(pieces_, &Piece::is_whole); }

 private:
  static constexpr double kFinestM = 7e-4;
  struct Piece {
    Triangle triangle;
    bool is_whole;
    Vec3 middle;
    double radius_m;
  };

  bool is_inner(const Vec3& p, const Vec3& normal) const {
    constexpr double kStepM = 1e-7;
    return std::abs(winding(p + kStepM * normal)) > 0.5 && std::abs(winding(p - kStepM * normal)) > 0.5;
  }
  void divide(const Triangle& t, const std::vector<Triangle>& others) {
    std::vector<Triangle> crossing;
    std::ranges::copy_if(others, std::back_inserter(crossing), [&](const Triangle& other) { return cross(t, other); });
    const auto& [a, b, c] = t;
    const Vec3 middle = (a + b + c) / 3, normal = (b - a).cross(c - a).normalized();
    const double edge_m = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    int inner = 0, border = 0;
    if (crossing.empty()) {
      // One sample point is not enough for two kinds of triangles: those that lie on another triangle without crossing
      // it, and those beside a hole. Parts of such a triangle may be inside.
      constexpr int kSamples = 3;
      for (int i = 0; i <= kSamples; ++i) {
        for (int k = 0; k <= kSamples - i && (inner == 0 || border == 0); ++k) {
          const Vec3 p = a + (b - a) * i / kSamples + (c - a) * k / kSamples;
          ++(is_inner(middle + 0.999 * (p - middle), normal) ? inner : border);
        }
      }
      if (border == 0) return;
    }
    const bool is_whole = crossing.empty() && inner == 0;
    if (is_whole || edge_m < kFinestM) {
      const double radius_m = std::max({(a - middle).norm(), (b - middle).norm(), (c - middle).norm()});
      pieces_.push_back({t, is_whole, middle, radius_m});
      return;
    }
    const Vec3 ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
    for (const Triangle& quarter :
         {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
      divide(quarter, crossing);
  }

  std::vector<Triangle> surface_;
  std::vector<Piece> pieces_;
};

/// Expected distance to a union of solids. Outside, it is the distance to the nearest solid. Inside, it is the depth in
/// the solid in which the point is deepest.
class UnionJudge {
 public:
  explicit UnionJudge(const std::vector<TriangleMesh>& solids) {
    for (const TriangleMesh& solid : solids) judges_.emplace_back(solid);
  }

  /// Out     least_m, most_m  bounds of the distance to the union; negative inside
  Range at(const Vec3& p) const {
    Range outside, inside{0, 0};
    for (const Judge& judge : judges_) {
      const Range range = judge.to_border(p);
      outside = {std::min(outside.least_m, range.least_m), std::min(outside.most_m, range.most_m)};
      if (std::abs(judge.winding(p)) <= 0.5) continue;
      // The tested tree also subdivides triangles. Its distance to the border may differ by the size of a piece.
      const double piece_m = judge.is_divided() ? kDividedM : 0;
      inside = {std::min(inside.least_m, -range.most_m - piece_m), std::min(inside.most_m, -range.least_m + piece_m)};
    }
    return inside.least_m < 0 ? inside : outside;
  }
  /// Returns true if the winding number of each solid is clearly above or below ½. Beside a hole, the number passes ½
  /// where no triangle is. A rounding error of the tree could change the classification of such points.
  bool is_sure(const Vec3& p) const {
    return std::ranges::none_of(judges_, [&](const Judge& judge) {
      return std::abs(std::abs(judge.winding(p)) - 0.5) < 2 * geometry::WindingNumber::kTolerance;
    });
  }
  Vec3 point(Random& random) const {
    const Vec3 on_border = judges_[random.next_u32() % judges_.size()].on_border(random);
    const double reach_m = std::pow(10.0, random.uniform(-5, -1.7));
    return on_border + reach_m * Vec3(random.normal(), random.normal(), random.normal()).normalized();
  }

 private:
  static constexpr double kDividedM = 5e-4;
  std::vector<Judge> judges_;
};

TriangleMesh moved(TriangleMesh mesh, const Vec3& by) {
  for (Vec3& vertex : mesh.vertices) vertex += by;
  return mesh;
}

TriangleMesh joined(const std::vector<TriangleMesh>& meshes) {
  TriangleMesh all;
  for (const TriangleMesh& mesh : meshes) contact::append(all, mesh);
  return all;
}

TriangleMesh without_triangles(TriangleMesh mesh, std::vector<std::ptrdiff_t> triangles) {
  std::ranges::sort(triangles, std::greater<>());
  for (const std::ptrdiff_t triangle : triangles) mesh.triangles.erase(mesh.triangles.begin() + triangle);
  return mesh;
}

/// Returns a box with two T-junctions: two triangles are divided at the midpoint of an edge, but their neighbours
/// across this edge are not.
TriangleMesh box_with_t_junctions(const Vec3& size_m) {
  TriangleMesh mesh = box_mesh(size_m);
  for (const std::size_t triangle : {2U, 10U}) {
    const auto [a, b, c] = mesh.triangles[triangle];
    const auto middle = static_cast<int>(mesh.vertices.size());
    const auto at = [&](int vertex) { return mesh.vertices[static_cast<std::size_t>(vertex)]; };
    mesh.vertices.emplace_back((at(a) + at(b)) / 2);
    mesh.triangles[triangle] = {a, middle, c};
    mesh.triangles.push_back({middle, b, c});
  }
  return mesh;
}

/// A tube along a figure of eight, which intersects itself at its centre.
TriangleMesh eight_tube(int along, int around, double radius_m) {
  TriangleMesh mesh;
  for (int i = 0; i < along; ++i) {
    const double u = 2 * std::numbers::pi * (i + 0.5) / along;
    const Vec3 at(0.02 * std::sin(u), 0.01 * std::sin(2 * u), 1e-3 * std::cos(u));
    const Vec3 ahead(0.02 * std::cos(u), 0.02 * std::cos(2 * u), -1e-3 * std::sin(u));
    const Vec3 right = Vec3::UnitZ().cross(ahead).normalized(), up = ahead.cross(right).normalized();
    for (int k = 0; k < around; ++k) {
      const double v = 2 * std::numbers::pi * k / around;
      mesh.vertices.emplace_back(at + radius_m * (std::cos(v) * right + std::sin(v) * up));
    }
  }
  for (int i = 0; i < along; ++i) {
    for (int k = 0; k < around; ++k) {
      const int next = (i + 1) % along * around, beside = (k + 1) % around;
      mesh.triangles.push_back({i * around + k, next + k, next + beside});
      mesh.triangles.push_back({i * around + k, next + beside, i * around + beside});
    }
  }
  return enclosed_m3(mesh) < 0 ? turned(mesh) : mesh;
}

TriangleMesh needle(Random& random) {
  TriangleMesh mesh = sphere_mesh(1, 0);
  const auto in_ball = [&] { return Vec3(random.normal(), random.normal(), random.normal()); };
  const Vec3 along = in_ball().normalized(), right = along.unitOrthogonal(), up = along.cross(right);
  const Vec3 middle = 4e-3 * in_ball();
  for (Vec3& p : mesh.vertices) p = middle + 0.015 * p.x() * along + 1e-3 * (p.y() * right + p.z() * up);
  return mesh;
}

struct Case {
  std::string name;
  TriangleMesh mesh;
  std::vector<TriangleMesh> solids;  ///< solids whose union the mesh represents
};

Case together(const std::string& name, const TriangleMesh& mesh) {
  return {name, mesh, {mesh}};
}

Case apart(const std::string& name, const std::vector<TriangleMesh>& solids) {
  return {name, joined(solids), solids};
}

std::vector<TriangleMesh> needles(std::uint64_t seed) {
  Random random(seed);
  std::vector<TriangleMesh> all;
  for (int i = 0; i < 30; ++i) all.push_back(needle(random));
  return all;
}

const Vec3 kAside(0.011, 0.002, 0.001), kAbove(0.004, 0.009, 0.003), kAcross(0.008, 0.007, 0.001);

/// Meshes that the repair leaves unchanged.
std::vector<Case> whole_cases(std::uint64_t seed) {
  const TriangleMesh ball = sphere_mesh(0.01, 2), cube = box_mesh(Vec3::Constant(0.02));
  Case turned_one = apart("one inside out", {ball, moved(ball, kAside), box_mesh({0.01, 0.01, 0.03})});
  turned_one.mesh = joined({ball, turned(moved(ball, kAside)), box_mesh({0.01, 0.01, 0.03})});
  turned_one.mesh = geometry::repaired(turned_one.mesh).mesh;
  return {apart("two balls", {ball, moved(ball, kAside)}),
          apart("three balls", {ball, moved(ball, kAside), moved(ball, kAbove)}),
          apart("nested boxes", {cube, box_mesh(Vec3::Constant(0.01))}),
          apart("touching boxes", {cube, moved(box_mesh(Vec3::Constant(0.01)), {0.015, 0.002, 0})}),
          together("an eight", eight_tube(40, 8, 3e-3)),
          turned_one,
          apart("needles", needles(seed))};
}

/// Meshes of several pieces that are closed only in combination, meshes with an inner wall, and open meshes.
std::vector<Case> unpaired_cases(std::uint64_t seed) {
  const TriangleMesh ball = sphere_mesh(0.01, 2);
  const TriangleMesh holed = without_triangles(ball, {100, 40, 41, 7}),
                     holed_aside = moved(without_triangles(ball, {3, 60, 61}), kAside);
  const TriangleMesh t_cube = box_with_t_junctions(Vec3::Constant(0.02));
  const TriangleMesh t_bar = moved(box_with_t_junctions({0.01, 0.02, 0.03}), kAcross);
  const TriangleMesh bar =
      moved(without_triangles(subdivided(box_mesh({0.03, 0.01, 0.01}), 2), {5}), {0.01, -0.003, 0.001});
  Case wall = together("a box with a wall", box_mesh({0.02, 0.03, 0.02}));
  wall.mesh.triangles.insert(wall.mesh.triangles.end(), {{0, 1, 7}, {0, 7, 6}});
  std::vector<TriangleMesh> open_needles = needles(seed);
  for (std::size_t i = 0; i < open_needles.size(); i += 3) open_needles[i] = without_triangles(open_needles[i], {0});
  return {together("two balls with holes", joined({holed, holed_aside})),
          {"three balls with holes",
           joined({holed, holed_aside, moved(ball, kAbove)}),
           {joined({holed, holed_aside}), moved(ball, kAbove)}},
          together("two boxes with T-junctions", joined({t_cube, t_bar})),
          together("three boxes with T-junctions and a hole", joined({t_cube, t_bar, bar})),
          wall,
          together("needles with holes", joined(open_needles))};
}

/// Meshes that the repair closes.
std::vector<Case> mended_cases() {
  const TriangleMesh ball = sphere_mesh(0.01, 2);
  const TriangleMesh cube = box_mesh(Vec3::Constant(0.02)), bar = moved(box_mesh({0.01, 0.02, 0.03}), kAcross);
  const TriangleMesh t_cube = box_with_t_junctions(Vec3::Constant(0.02));
  const TriangleMesh t_bar = moved(box_with_t_junctions({0.01, 0.02, 0.03}), kAcross);
  TriangleMesh wall = cube;
  wall.triangles.insert(wall.triangles.end(), {{0, 1, 7}, {0, 7, 6}});
  return {{"two boxes with T-junctions", joined({t_cube, t_bar}), {cube, bar}},
          {"a box with a wall", wall, {cube}},
          {"a box with a wall in a ball with a hole, and one inside out",
           joined({wall, moved(without_triangles(ball, {100}), kAside),
                   turned(moved(without_triangles(ball, {40}), kAbove))}),
           {cube, moved(ball, kAside), moved(ball, kAbove)}},
          {"boxes of one size that touch",
           joined({cube, moved(cube, {0.02, 0, 0})}),
           {moved(box_mesh({0.04, 0.02, 0.02}), {0.01, 0, 0})}}};
}

/// Compares the tree's distances with the reference, and checks that enough points are inside.
void expect_tree_agrees(const Case& one, const UnionJudge& judge, Random random) {
  SCOPED_TRACE(one.name);
  const TriangleTree tree = TriangleTree::of_solid(one.mesh, {});
  constexpr int kPoints = 600;
  int inside = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 p = judge.point(random);
    if (!judge.is_sure(p)) continue;
    const Range expected = judge.at(p);
    const double distance_m = tree.signed_distance_m(p);
    inside += expected.least_m < 0;
    EXPECT_EQ(distance_m < 0, expected.least_m < 0)
        << p.transpose() << ": " << distance_m << ", not " << expected.least_m;
    EXPECT_GE(distance_m, expected.least_m - 1e-12) << p.transpose();
    EXPECT_LE(distance_m, expected.most_m + 1e-12) << p.transpose();
  }
  EXPECT_GT(inside, kPoints / 5);
}

void expect_grid_agrees(const Case& one, const UnionJudge& judge, Random random) {
  SCOPED_TRACE(one.name);
  const geometry::ContactMesh mesh = geometry::repaired(one.mesh);
  EXPECT_EQ(mesh.kind, geometry::SurfaceKind::kSolid);
  EXPECT_TRUE(mesh.sheet.triangles.empty());
  ContactShapeOptions options;
  options.tolerance_m = 1e-4;
  const auto grid = DistanceGrid::build(mesh, TriangleTree::of_solid(mesh.mesh, mesh.inner), options, {});
  EXPECT_LT(grid->error_m(), 3e-4);
  int near = 0, far = 0;
  for (int i = 0; i < 600; ++i) {
    const Vec3 p = judge.point(random);
    if (!judge.is_sure(p)) continue;
    const Range expected = judge.at(p);
    const double distance_m = grid->distance_m(p);
    if (std::max(-expected.least_m, expected.most_m) > grid->band_m()) {
      EXPECT_EQ(distance_m < 0, expected.least_m < 0) << p.transpose();
      ++far;
      continue;
    }
    EXPECT_GE(distance_m, expected.least_m - grid->error_m()) << p.transpose();
    EXPECT_LE(distance_m, expected.most_m + grid->error_m()) << p.transpose();
    ++near;
  }
  EXPECT_GT(near, 200);
  EXPECT_GT(far, 40);
}

constexpr std::uint64_t kUsualSeed = 7;

TEST(UnionJudge, ATreeIsRightForOverlappingSolids) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const Case& one : whole_cases(seed)) expect_tree_agrees(one, UnionJudge(one.solids), Random(seed, 1));
}

TEST(UnionJudge, ATreeIsRightWhereEdgesDoNotPairUp) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const Case& one : unpaired_cases(seed)) expect_tree_agrees(one, UnionJudge(one.solids), Random(seed, 2));
}

TEST(UnionJudge, AGridOfSolidsThatOverlapIsRightToItsStatedError) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const Case& one : whole_cases(seed)) expect_grid_agrees(one, UnionJudge(one.solids), Random(seed, 3));
}

TEST(UnionJudge, AGridOfWhatRepairMakesWholeIsRightToItsStatedError) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  for (const Case& one : mended_cases()) expect_grid_agrees(one, UnionJudge(one.solids), Random(seed, 4));
}

}  // namespace
}  // namespace tandem::contact
