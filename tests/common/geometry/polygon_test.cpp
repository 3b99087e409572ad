#include "common/geometry/polygon.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/test_seed.hpp"

namespace tandem::geometry {
namespace {

ConvexPolygon regular(int corners, double radius, const Vec2& centre, double turn) {
  ConvexPolygon polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = turn + 2 * std::numbers::pi * i / corners;
    polygon.push_back(centre + radius * Vec2(std::cos(angle), std::sin(angle)));
  }
  return polygon;
}

bool contains(std::span<const Vec2> convex, const Vec2& p) {
  for (std::size_t i = 0; i < convex.size(); ++i) {
    const Vec2 along = convex[(i + 1) % convex.size()] - convex[i], to = p - convex[i];
    if (along.x() * to.y() - along.y() * to.x() < 0) return false;
  }
  return true;
}

TEST(Polygon, TwoUnitSquaresShiftedByAQuarterShareThreeQuarters) {
  const std::vector<Vec2> a{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, b{{0.25, 0}, {1.25, 0}, {1.25, 1}, {0.25, 1}};
  EXPECT_DOUBLE_EQ(common_area(a, b), 0.75);
  EXPECT_DOUBLE_EQ(common_area(b, a), 0.75);
  const std::vector<Vec2> apart{{2, 0}, {3, 0}, {3, 1}};
  EXPECT_EQ(common_area(a, apart), 0);
}

/// Compares with a reference that counts points of a fine grid inside both polygons.
TEST(Polygon, CommonAreaOfRandomPolygonsIsThatOfAGrid) {
  std::mt19937_64 random(test::test_seed(65));
  std::uniform_real_distribution<double> place(-0.5, 0.5), size(0.3, 1), turn(0, 6.3);
  std::uniform_int_distribution<int> corners(3, static_cast<int>(kMaxConvexCorners));
  constexpr int kCells = 200;
  constexpr double kCell = 4.0 / kCells;
  for (int trial = 0; trial < 40; ++trial) {
    const auto a = regular(corners(random), size(random), {place(random), place(random)}, turn(random));
    const auto b = regular(corners(random), size(random), {place(random), place(random)}, turn(random));
    int inside = 0;
    for (int i = 0; i < kCells; ++i) {
      for (int j = 0; j < kCells; ++j) {
        const Vec2 p(-2 + (i + 0.5) * kCell, -2 + (j + 0.5) * kCell);
        inside += contains(a, p) && contains(b, p) ? 1 : 0;
      }
    }
    // A cell on the border is counted wrongly by at most its area. The border of the intersection is at most 2π long.
    const double tolerance = 2 * std::numbers::pi * kCell;
    EXPECT_NEAR(common_area(a, b), inside * kCell * kCell, tolerance) << trial;
  }
}

TEST(Polygon, TrianglesOfARandomStarHaveItsAreaAndCentre) {
  std::mt19937_64 random(test::test_seed(66));
  std::uniform_real_distribution<double> radius(0.2, 1);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<Vec2> star;
    const int corners = 3 + trial % 30;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      star.push_back(radius(random) * Vec2(std::cos(angle), std::sin(angle)));
    }
    const std::vector<Triangle2> triangles = triangulate(star);
    ASSERT_EQ(triangles.size(), star.size() - 2) << trial;
    double area = 0;
    Vec2 sum = Vec2::Zero();
    for (const Triangle2& triangle : triangles) {
      EXPECT_GT(signed_area(triangle), 0) << trial;
      area += signed_area(triangle);
      sum += signed_area(triangle) * (triangle[0] + triangle[1] + triangle[2]) / 3;
    }
    EXPECT_NEAR(area, signed_area(star), 1e-12) << trial;
    EXPECT_NEAR((sum / area - centroid(star)).norm(), 0, 1e-12) << trial;
  }
}

TEST(Polygon, ACrossingOrClockwisePolygonHasNoTriangles) {
  EXPECT_TRUE(triangulate(std::vector<Vec2>{{0, 0}, {0, 1}, {1, 1}, {1, 0}}).empty());
  EXPECT_TRUE(triangulate(std::vector<Vec2>{{0, 0}, {1, 1}, {1, 0}, {0, 1}}).empty());
  EXPECT_TRUE(triangulate(std::vector<Vec2>{{0, 0}, {4, 0}, {4, 3}, {1, -1}, {0, 3}}).empty());
}

TEST(Polygon, OnlyCounterclockwiseConvexPolygonsAreConvex) {
  EXPECT_TRUE(is_convex(std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  EXPECT_FALSE(is_convex(std::vector<Vec2>{{0, 1}, {1, 1}, {1, 0}, {0, 0}}));
  EXPECT_FALSE(is_convex(std::vector<Vec2>{{0, 0}, {2, 0}, {1, 0.5}, {2, 2}}));
  // A pentagram turns left at every corner, but its corners go around twice, so it is not convex.
  std::vector<Vec2> pentagram;
  for (int i = 0; i < 5; ++i)
    pentagram.emplace_back(std::cos(4 * std::numbers::pi * i / 5), std::sin(4 * std::numbers::pi * i / 5));
  EXPECT_FALSE(is_convex(pentagram));
}

}  // namespace
}  // namespace tandem::geometry
