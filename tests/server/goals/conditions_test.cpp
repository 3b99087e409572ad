// Tests the conditions of goals for given states of bodies.
#include "server/goals/conditions.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <random>

#include "server/goals/game_plan.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;

struct Bodies {
  std::array<RigidState, 3> states;
  std::array<std::uint8_t, 3> holders{};
  std::uint64_t absent = 0, covered = 0;

  bool holds(const GoalCondition& condition) const {
    return server::holds(condition, {states, holders, absent, covered});
  }
};

InRegionCondition in_box(const Vec3& half_m) {
  return {.body = 0, .region = {.half_m = half_m}, .balls = {{Vec3::Zero(), 0}}};
}

TEST(GoalConditions, ABodyIsInABoxUpToItsFaces) {
  Bodies bodies;
  const GoalCondition condition = in_box({0.1, 0.2, 0.3});
  bodies.states[0].X.p = {0.1, -0.2, 0.3};
  EXPECT_TRUE(bodies.holds(condition));
  bodies.states[0].X.p.x() = 0.1001;
  EXPECT_FALSE(bodies.holds(condition));
}

TEST(GoalConditions, ARegionMovesWithItsBody) {
  Bodies bodies;
  InRegionCondition condition = in_box({0.01, 0.01, 0.01});
  condition.region.body = 1;
  condition.region.X_FR.p = {0.5, 0, 0};
  bodies.states[1].X = {{1, 0, 0}, quaternion_of(Vec3(0, 0, 90 * kDegree_rad))};
  bodies.states[0].X.p = {1, 0.5, 0};
  EXPECT_TRUE(bodies.holds(condition));
  bodies.states[1].X.q = Quat::Identity();
  EXPECT_FALSE(bodies.holds(condition));
}

TEST(GoalConditions, AWholeBallNeedsItsRadiusInASphereAndACylinder) {
  Bodies bodies;
  InRegionCondition condition = in_box(Vec3::Zero());
  condition.balls = {{Vec3::Zero(), 0.02}};
  condition.region.kind = GoalRegion::Kind::kSphere;
  condition.region.half_m = {0.05, 0, 0};
  bodies.states[0].X.p = {0.03, 0, 0};
  EXPECT_TRUE(bodies.holds(condition));
  bodies.states[0].X.p = {0.031, 0, 0};
  EXPECT_FALSE(bodies.holds(condition));
  condition.region.kind = GoalRegion::Kind::kCylinder;
  condition.region.half_m = {0.05, 0, 0.04};
  bodies.states[0].X.p = {0, 0.03, 0.02};
  EXPECT_TRUE(bodies.holds(condition));
  bodies.states[0].X.p = {0, 0.03, 0.021};
  EXPECT_FALSE(bodies.holds(condition));
}

TEST(GoalConditions, APoseHoldsUpToItsTolerances) {
  Bodies bodies;
  const AtPoseCondition condition{.body = 0,
                                  .beside = 1,
                                  .X_FT = {{0, 0, 0.1}, Quat::Identity()},
                                  .position_m = 0.01,
                                  .angle_rad = 10 * kDegree_rad};
  bodies.states[1].X.p = {1, 0, 0};
  bodies.states[0].X = {{1.0099, 0, 0.1}, quaternion_of(Vec3(0, 9.9 * kDegree_rad, 0))};
  EXPECT_TRUE(bodies.holds(condition));
  bodies.states[0].X.q = quaternion_of(Vec3(0, 10.1 * kDegree_rad, 0));
  EXPECT_FALSE(bodies.holds(condition));
  bodies.states[0].X = {{1.0101, 0, 0.1}, Quat::Identity()};
  EXPECT_FALSE(bodies.holds(condition));
}

TEST(GoalConditions, ABodyIsHeldByAtLeastSoManyHands) {
  Bodies bodies;
  bodies.holders[2] = 1;
  EXPECT_TRUE(bodies.holds(HeldCondition{2, 1}));
  EXPECT_FALSE(bodies.holds(HeldCondition{2, 2}));
  EXPECT_FALSE(bodies.holds(HeldCondition{0, 1}));
}

TEST(GoalConditions, ASlowBodyIsBelowBothSpeeds) {
  Bodies bodies;
  const SlowerCondition condition{0, 0.01, 30 * kDegree_rad};
  bodies.states[0].V = {{0.009, 0, 0}, {0, 29 * kDegree_rad, 0}};
  EXPECT_TRUE(bodies.holds(condition));
  bodies.states[0].V.v.x() = 0.01;
  EXPECT_FALSE(bodies.holds(condition));
  bodies.states[0].V = {Vec3::Zero(), {0, 31 * kDegree_rad, 0}};
  EXPECT_FALSE(bodies.holds(condition));
}

TEST(GoalConditions, ASilhouetteHoldsWhileItsSearchFindsItCovered) {
  Bodies bodies;
  bodies.covered = 0b10;
  EXPECT_FALSE(bodies.holds(SilhouetteCondition{0}));
  EXPECT_TRUE(bodies.holds(SilhouetteCondition{1}));
}

TEST(GoalConditions, NoConditionHoldsOfABodyThatDoesNotExist) {
  Bodies bodies;
  bodies.holders[0] = 1;
  InRegionCondition in_region = in_box({1, 1, 1});
  in_region.region.body = 1;
  const std::array<GoalCondition, 4> conditions{
      in_region, AtPoseCondition{.body = 0, .beside = 1, .position_m = 1, .angle_rad = 1}, HeldCondition{0, 1},
      SlowerCondition{0, 1, 1}};
  for (const GoalCondition& condition : conditions) {
    bodies.absent = 0;
    EXPECT_TRUE(bodies.holds(condition)) << condition.index();
    bodies.absent = 0b1;
    EXPECT_FALSE(bodies.holds(condition)) << condition.index();
    bodies.absent = 0b10;
    EXPECT_EQ(bodies.holds(condition), condition.index() >= 2) << condition.index();
  }
}

RigidState random_state(std::mt19937_64& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  RigidState state;
  state.X.p = {number(random), number(random), number(random)};
  state.X.q = quaternion_of(3 * Vec3(number(random), number(random), number(random)));
  state.V = {{number(random), number(random), number(random)}, {number(random), number(random), number(random)}};
  return state;
}

/// Conditions that are relative to a body, or that refer to a speed, must not change if all bodies are moved together.
/// Fails if a condition is computed in the world's frame instead of the body's frame.
TEST(GoalConditions, RelativeConditionsDoNotDependOnTheFrameOfTheWorld) {
  std::mt19937_64 random(test::test_seed(165));
  int held = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Bodies bodies;
    for (RigidState& state : bodies.states) state = random_state(random);
    InRegionCondition in_region = in_box({0.9, 1.1, 1.3});
    in_region.region.body = 1;
    in_region.region.kind = static_cast<GoalRegion::Kind>(trial % 3);
    in_region.region.X_FR = random_state(random).X;
    in_region.balls.push_back({random_state(random).X.p / 4, 0.05});
    AtPoseCondition at_pose{.body = 2, .beside = 1, .X_FT = random_state(random).X, .position_m = 1.5, .angle_rad = 2};
    const SlowerCondition slower{0, 1, 1};
    const Pose X = random_state(random).X;
    Bodies moved = bodies;
    for (RigidState& state : moved.states) state = {X * state.X, {X.q * state.V.v, X.q * state.V.w}};
    for (const GoalCondition& condition : {GoalCondition(in_region), GoalCondition(at_pose), GoalCondition(slower)}) {
      EXPECT_EQ(bodies.holds(condition), moved.holds(condition)) << trial << " " << condition.index();
      held += bodies.holds(condition) ? 1 : 0;
    }
  }
  EXPECT_GT(held, 500) << "the trials must contain both answers";
  EXPECT_LT(held, 5500);
}

/// A body that is completely in a region must also be in every larger region.
TEST(GoalConditions, AHigherLimitNeverEndsACondition) {
  std::mt19937_64 random(test::test_seed(166));
  std::uniform_real_distribution<double> size(0.1, 1);
  for (int trial = 0; trial < 2000; ++trial) {
    Bodies bodies;
    bodies.states[0] = random_state(random);
    InRegionCondition small = in_box({size(random), size(random), size(random)});
    small.region.kind = static_cast<GoalRegion::Kind>(trial % 3);
    small.balls = {{random_state(random).X.p / 10, size(random) / 10}};
    InRegionCondition large = small;
    large.region.half_m += Vec3(size(random), size(random), size(random));
    EXPECT_TRUE(!bodies.holds(small) || bodies.holds(large)) << trial;
  }
}

TEST(GoalConditions, BallsOfABodyEncloseItsShapes) {
  SolidShape box, cylinder, capsule;
  for (const double size : {0.2, 0.4, 0.6}) box.shape.mutable_box()->add_size_m(size);
  box.shape.mutable_placement()->add_position_m(1);
  for (int i = 0; i < 2; ++i) box.shape.mutable_placement()->add_position_m(0);
  cylinder.shape.mutable_cylinder()->set_radius_m(0.1);
  cylinder.shape.mutable_cylinder()->set_length_m(0.3);
  capsule.shape.mutable_capsule()->set_radius_m(0.1);
  capsule.shape.mutable_capsule()->set_length_m(0.3);
  const auto farthest = [](const std::vector<BodyBall>& balls, const Vec3& along) {
    double most = -10;
    for (const BodyBall& ball : balls) most = std::max(most, ball.p_B.dot(along) + ball.radius_m);
    return most;
  };
  EXPECT_DOUBLE_EQ(farthest(balls_of({box}), Vec3::UnitX()), 1.1);
  EXPECT_DOUBLE_EQ(farthest(balls_of({box}), -Vec3::UnitZ()), 0.3);
  EXPECT_DOUBLE_EQ(farthest(balls_of({capsule}), Vec3::UnitZ()), 0.25);
  for (int i = 0; i < 360; ++i) {
    const Vec3 along(std::cos(i * kDegree_rad), std::sin(i * kDegree_rad), 0);
    const double radius_m = farthest(balls_of({cylinder}), along);
    EXPECT_GE(radius_m, 0.1 - 1e-12);
    EXPECT_LE(radius_m, 0.1021) << "a prism of 16 sides is at most 2 % wider";
  }
  EXPECT_LE(balls_of(std::vector<SolidShape>(100, box)).size(), kMaxBodyBalls);
}

}  // namespace
}  // namespace tandem::server
