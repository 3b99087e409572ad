// Tests a step in two parts: the contacts are searched in idle time before the step. The result must equal that of an
// undivided step.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "common/physics/touch/near_pairs.hpp"
#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {
namespace {

constexpr const char* kCubeOnTable =
    R"({"name": "table", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}},
       {"name": "cube", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2, "graspable": true,
        "placement": {"position_m": [0, 0, 0.02]}},
       {"name": "high", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2,
        "placement": {"position_m": [0.3, 0, 0.3]}})";

World cubes() {
  return server::make_server_world(
      load_parts({.bodies = kCubeOnTable, .tools = R"({"name": "t", "placement": {"position_m": [0, 0, 0.06]}})"}));
}

TEST(TwoPartStep, IsFinishedOnceAndNeverLeftUndone) {
  World whole = cubes(), twice = cubes(), never = cubes();
  for (int i = 0; i < 20; ++i) {
    whole.step();
    twice.answer();
    twice.finish();
    EXPECT_EQ(twice.finish(), 0U) << "a second call must have no work";
    never.answer();
  }
  never.finish();
  EXPECT_LT(whole.body(BodyId{3}).V.v.z(), -0.1);
  EXPECT_TRUE(is_same(twice.body(BodyId{3}), whole.body(BodyId{3})));
  EXPECT_TRUE(is_same(never.body(BodyId{3}), whole.body(BodyId{3}))) << "the next answer finishes the last";
}

TEST(TwoPartStep, WhatHandsMoveIsThereWhenItIsAnsweredAndTheRestIsTold) {
  World world = cubes();
  world.activate_tool(0);
  for (int i = 1; i < 220; ++i) {
    world.set_handle(0, at({0, 0, 0.06 - 1e-4 * i}));
    const RigidState tool_before = world.tool(0).tool;
    world.answer();
    const RigidState tool = world.tool(0).tool, pressed = world.body(BodyId{2}), falling = world.body(BodyId{3});
    EXPECT_FALSE(is_same(tool, tool_before));
    world.finish();
    EXPECT_TRUE(is_same(world.tool(0).tool, tool));
    const bool is_tools = world.touch(0).contacts > 0 && i > 200;
    EXPECT_TRUE(!is_tools || is_same(world.body(BodyId{2}), pressed));
    // The first part of the step predicts poses from the previous velocities. Gravity then moves the falling body by up
    // to g h² farther, with the step h.
    const double more_m = 9.81 * kStep_s * kStep_s;
    EXPECT_LT((world.body(BodyId{3}).X.p - falling.X.p).norm(), 1.01 * more_m);
  }
  EXPECT_GT(world.touch(0).contacts, 0U);
  EXPECT_LT(world.body(BodyId{3}).X.p.z(), 0.1);
}

/// Position of the hand in a step. The hand descends fast, presses, drags the cube, lifts off and hits the cube again.
/// Then the hand jumps by a hundred times the expected distance.
Vec3 hand_at(int step) {
  const double t = kStep_s * step;
  const double down = step < 300   ? std::min(0.03, 0.3 * t)
                      : step < 500 ? 0.03 - 0.1 * (t - 0.3)
                                   : std::min(0.05, 1.0 * (t - 0.5));
  return {0.02 * std::sin(4 * t) + (step >= 800 && step < 810 ? 0.1 : 0), 0, 0.06 - down};
}

TEST(LookAhead, DoesNotChangeTheForce) {
  World plain = cubes(), with = cubes();
  plain.activate_tool(0);
  with.activate_tool(0);
  double most_n = 0;
  std::uint32_t touched = 0;
  for (int i = 0; i < 1000; ++i) {
    if (i == 700) {  // the body is displaced after its contacts were searched
      for (World* world : {&plain, &with}) world->set_body(BodyId{2}, at({0.005, 0.001, 0.02}));
    }
    if (i == 250 || i == 900) {  // from now on the tool holds the body and no longer touches it
      for (World* world : {&plain, &with}) EXPECT_EQ(world->grab(0, BodyId{2}), GrabResult::kGrabbed);
    }
    if (i == 280 || i == 930) {
      for (World* world : {&plain, &with}) world->release(0);
    }
    for (World* world : {&plain, &with}) world->set_handle(0, at(hand_at(i)));
    EXPECT_EQ(plain.step(), with.step()) << i;
    with.look_ahead();
    touched += with.touch(0).contacts > 0 ? 1 : 0;
    const Vec3 force = plain.tool(0).wrench_on_hand_W.f;
    most_n = std::max(most_n, force.norm());
    // Results with and without look-ahead may differ by some 1e-3 if the iteration for friction ends at its limit
    // before it converges.
    ASSERT_LT((with.tool(0).wrench_on_hand_W.f - force).norm(), 1e-3 * (1 + force.norm())) << i;
    ASSERT_LT((with.body(BodyId{2}).X.p - plain.body(BodyId{2}).X.p).norm(), 1e-5) << i;
  }
  EXPECT_GT(most_n, 3);
  EXPECT_GT(touched, 300U);
}

/// A ball at the distance `gap_m` above a cube.
struct BallOverCube {
  explicit BallOverCube(double band_m) : pair(contact::kContactBudget) {
    pair.contacts.bind(ball.get(), cube.get());
    pair.band_m = band_m;
  }
  static Pose above(double gap_m) { return {{0, 0, kCubeEdge_m / 2 + kBallRadius_m + gap_m}, Quat::Identity()}; }
  std::size_t found(double gap_m) {
    pair.find(above(gap_m), Pose{});
    return pair.contacts.contacts().size();
  }

  std::shared_ptr<const contact::ContactShape> ball = contact::make_contact_sphere(kBallRadius_m);
  std::shared_ptr<const contact::ContactShape> cube = contact::make_contact_box(Vec3::Constant(kCubeEdge_m));
  NearPairs::Pair pair;
};

TEST(NearPairs, AResultFoundAheadIsUsedOnceAndOnlyAtItsPose) {
  BallOverCube near(1e-4);
  near.pair.find_ahead(BallOverCube::above(-1e-4), Pose{});
  const std::size_t pressing = near.pair.contacts.contacts().size();
  ASSERT_GT(pressing, 0U);
  // Marks a stored contact with a depth that no search returns. If the depth is unchanged after the step, the step has
  // used the stored contacts without a new search.
  near.pair.contacts.contacts()[0].depth_m = 0.5;
  EXPECT_EQ(near.found(-1e-4), pressing);
  EXPECT_EQ(near.pair.contacts.contacts()[0].depth_m, 0.5);
  EXPECT_EQ(near.found(-1e-4), pressing);
  EXPECT_LT(near.pair.contacts.contacts()[0].depth_m, 1e-3) << "a second time it is searched for";
  near.pair.find_ahead(BallOverCube::above(-1e-4), Pose{});
  EXPECT_EQ(near.found(1e-2), 0U) << "it has moved away";
  near.pair.find_ahead(BallOverCube::above(1e-2), Pose{});
  EXPECT_EQ(near.found(-1e-4), pressing) << "it has come";
}

/// A ball above a cube, as objects of the touch stage.
struct TwoThings {
  TwoThings() {
    things[0].role = TouchThing::Role::kImplicit;
    things[1].role = TouchThing::Role::kStatic;
  }
  /// Returns the search distance of the pair in a step. `ahead_m` is the reach for the look-ahead, `reach_m` the reach
  /// for the step.
  double band_m(double ahead_m, double reach_m) {
    pairs.look_ahead(things, std::array{ahead_m, 0.0});
    if (change) change(*this);
    EXPECT_EQ(pairs.find(things, std::array{reach_m, 0.0}), 0U);
    return pairs.near().empty() ? 0 : pairs.near().front()->band_m;
  }

  BodyDescription body = cube(Vec3::Zero(), 0);
  ToolDescription tool = ball_tool({0, 0, kCubeEdge_m / 2 + kBallRadius_m});
  RigidBody ball{tool.mass, {}, kBallRadius_m, tool.X_WT}, block{body.mass, {}, kCubeEdge_m, body.X_WB};
  std::array<TouchThing, 2> things{TouchThing{&ball, &tool.touch}, TouchThing{&block, &body.touch}};
  NearPairs pairs{2, 4, contact::kContactBudget};
  std::function<void(TwoThings&)> change;  ///< called between look-ahead and step
};

TEST(NearPairs, APredictedPairIsUsedUnlessSomethingChanged) {
  TwoThings two;
  EXPECT_DOUBLE_EQ(two.band_m(1e-3, 1e-4), 1.5e-3) << "as it was looked for";
  EXPECT_DOUBLE_EQ(two.band_m(1e-4, 1e-3), 1.5e-3) << "it gets farther than that";
  two.change = [](TwoThings& of) { of.ball.set_state(at({0, 0, kCubeEdge_m / 2 + kBallRadius_m + 1e-5})); };
  EXPECT_DOUBLE_EQ(two.band_m(1e-3, 1e-4), 1.5e-4) << "it has moved";
  two.change = [](TwoThings& of) { of.things[1].role = TouchThing::Role::kExternal; };
  EXPECT_DOUBLE_EQ(two.band_m(1e-3, 1e-4), 1.5e-4) << "it is something else";
  two.change = [](TwoThings& of) { of.things[0].passes_through = 1; };
  EXPECT_DOUBLE_EQ(two.band_m(1e-3, 1e-4), 0) << "they do not meet any more";
}

TEST(NearPairs, APairKeepsItsFrictionWhenItsOtherBodyBecomesImplicitToo) {
  TwoThings two;
  two.things[0].role = TouchThing::Role::kExternal;
  two.things[1].role = TouchThing::Role::kImplicit;
  const std::array reach_m{1e-4, 1e-4};
  ASSERT_EQ(two.pairs.find(two.things, reach_m), 0U);
  ASSERT_EQ(two.pairs.near().size(), 1U);
  NearPairs::Pair* const pair = two.pairs.near().front();
  ASSERT_EQ(pair->thing_a, 1U);
  pair->deepest_m = 1e-5;
  two.things[0].role = TouchThing::Role::kImplicit;
  ASSERT_EQ(two.pairs.find(two.things, reach_m), 0U);
  ASSERT_EQ(two.pairs.near().size(), 1U);
  EXPECT_EQ(two.pairs.near().front(), pair);
  EXPECT_EQ(pair->deepest_m, 1e-5) << "it was not bound anew";
  // Only the ball becomes implicit, although it is the second object of the pair. The pair and its stored contacts must
  // remain the same.
  two.things[1].role = TouchThing::Role::kExternal;
  ASSERT_EQ(two.pairs.find(two.things, reach_m), 0U);
  ASSERT_EQ(two.pairs.near().size(), 1U);
  EXPECT_EQ(two.pairs.near().front(), pair);
  EXPECT_EQ(pair->thing_b, 0U);
  EXPECT_EQ(pair->deepest_m, 1e-5) << "it was not bound anew";
}

TEST(NearPairs, AWiderBandIsSearchedAnew) {
  BallOverCube near(5e-5);
  near.pair.find_ahead(BallOverCube::above(1e-4), Pose{});
  EXPECT_TRUE(near.pair.contacts.contacts().empty());
  near.pair.band_m = 2e-4;
  EXPECT_GT(near.found(1e-4), 0U);
}

}  // namespace
}  // namespace tandem::physics
