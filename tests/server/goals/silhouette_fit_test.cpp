// Tests the search for the placement at which boards cover a figure best.
#include "server/goals/silhouette_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Outlines of the four boards of the T puzzle, each at its position in the figure. The unit is the width of the bar.
/// The search needs convex polygons, so the pentagon, which is not convex, consists of two.
const std::vector<std::vector<Vec2>> kTriangle{{{-1, 0}, {0, 1}, {-1, 1}}};
const std::vector<std::vector<Vec2>> kPentagon{{{0, -1}, {1, 0}, {0, 1}}, {{-1, 0}, {0, 0}, {0, 1}}};
const std::vector<std::vector<Vec2>> kTrapezoid{{{0, 1}, {1, 0}, {2, 0}, {2, 1}}};
const std::vector<std::vector<Vec2>> kStem{{{0, -3}, {1, -3}, {1, 0}, {0, -1}}};
const std::vector<Vec2> kT{{-1, 0}, {0, 0}, {0, -3}, {1, -3}, {1, 0}, {2, 0}, {2, 1}, {-1, 1}};

SilhouettePlan t_plan() {
  SilhouettePlan plan;
  std::size_t body = 0;
  for (const auto& board : {kTriangle, kPentagon, kTrapezoid, kStem}) {
    for (const std::vector<Vec2>& outline : board) plan.pieces.push_back({body, outline});
    ++body;
  }
  plan.figure = geometry::triangulate(kT);
  plan.figure_area_m2 = geometry::signed_area(kT);
  plan.figure_centre = geometry::centroid(kT);
  return plan;
}

/// Advances until a search has ended. Returns the number of steps.
int search(SilhouetteFit& fit, const std::vector<RigidState>& bodies) {
  int steps = 0;
  for (; steps < 100 + SilhouetteFit::kMaxPlacements + 1; ++steps) {
    fit.advance(bodies);
    if (fit.covered() > 0) break;
  }
  return steps;
}

RigidState placed(double x, double y, double degrees) {
  RigidState state;
  state.X = {{x, y, 0.1}, quaternion_of(Vec3(0, 0, degrees * kDegree))};
  return state;
}

TEST(SilhouetteFit, TheBoardsOfTheTCoverItWhereverTheyLie) {
  std::mt19937_64 random(test::test_seed(365));
  std::uniform_real_distribution<double> place(-5, 5), turn(-180, 180);
  for (int trial = 0; trial < 100; ++trial) {
    SilhouetteFit fit(t_plan());
    const RigidState all = placed(place(random), place(random), turn(random));
    const int steps = search(fit, std::vector<RigidState>(4, all));
    EXPECT_TRUE(fit.is_covered()) << trial << ": " << fit.covered() << " covered, " << fit.outside() << " outside";
    EXPECT_LE(steps, 100 + SilhouetteFit::kMaxPlacements);
  }
}

TEST(SilhouetteFit, GapsUpToTheTolerancesAreAccepted) {
  SilhouetteFit near(t_plan()), far(t_plan());
  std::vector<RigidState> bodies(4);
  // Displaces this board by 0.1, which leaves 0.1 of its area outside of the figure. The figure has an area of 6.
  bodies[2] = placed(0.1, 0, 0);
  search(near, bodies);
  EXPECT_TRUE(near.is_covered()) << near.covered();
  bodies[2] = placed(0.5, 0, 0);
  search(far, bodies);
  EXPECT_FALSE(far.is_covered()) << far.covered();
  EXPECT_LT(far.covered(), 0.95);
}

TEST(SilhouetteFit, StackedBoardsDoNotCoverTwice) {
  SilhouettePlan plan;
  const std::vector<Vec2> square{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, wide{{0, 0}, {2, 0}, {2, 1}, {0, 1}};
  plan.pieces = {{0, square}, {1, square}};
  plan.figure = geometry::triangulate(wide);
  plan.figure_area_m2 = 2;
  plan.figure_centre = geometry::centroid(wide);
  SilhouetteFit stacked(plan), beside(plan);
  search(stacked, {placed(0, 0, 0), placed(0, 0, 0)});
  EXPECT_FALSE(stacked.is_covered());
  EXPECT_LE(stacked.covered(), 0.51);
  search(beside, {placed(0, 0, 0), placed(1, 0, 0)});
  EXPECT_TRUE(beside.is_covered());
}

TEST(SilhouetteFit, AMirroredBoardCountsByItsOutlineFromAbove) {
  SilhouetteFit fit(t_plan());
  std::vector<RigidState> bodies(4);
  // Turns the triangle upside down by a rotation of 180° about its axis of symmetry, x + y = 0. It covers the same
  // area.
  bodies[0].X.q = quaternion_of(Vec3(1, -1, 0).normalized() * std::numbers::pi);
  bodies[0].X.p = Vec3(-1, 1, 0) - bodies[0].X.q * Vec3(-1, 1, 0);
  search(fit, bodies);
  EXPECT_TRUE(fit.is_covered()) << fit.covered();
}

TEST(SilhouetteFit, AMovingBoardEndsTheCover) {
  SilhouetteFit fit(t_plan());
  std::vector<RigidState> bodies(4);
  search(fit, bodies);
  ASSERT_TRUE(fit.is_covered());
  bodies[1].V.v.x() = 0.03;
  fit.advance(bodies);
  EXPECT_FALSE(fit.is_covered());
  bodies[1].V.v.x() = 0;
  fit.advance(bodies, 0b1);
  EXPECT_FALSE(fit.is_covered());
}

}  // namespace
}  // namespace tandem::server
