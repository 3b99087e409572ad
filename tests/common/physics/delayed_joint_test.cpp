// Copies of a body that several people touch: how stiffly they are joined, and what a join does at the server.
#include "common/physics/joints/delayed_joint.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <span>

#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {
namespace {

constexpr BodyId kBody{1};
const Joint kJoint{200, 20, 0.2, 0.02};
const Joint kSpring{200, 0, 0, 0};
constexpr Duration kHundred_ms{std::chrono::milliseconds(100)};

TEST(DelayedJoint, IsAShareOfItsDamperOverTheOneWayDelay) {
  const Joint joint = DelayedJoint::joint(kHundred_ms, Duration{0}, Vec3::UnitX());
  const double along = DelayedJoint::kAlongStiffnessShare * DelayedJoint::kAlongDamping_n_s_per_m;
  const double across = DelayedJoint::kAcrossStiffnessShare * DelayedJoint::kAcrossDamping_n_s_per_m;
  EXPECT_NEAR(joint.axis_stiffness_n_per_m, along / 0.05, 1e-9);
  EXPECT_NEAR(joint.stiffness_n_per_m, across / 0.05, 1e-9);
  EXPECT_NEAR(joint.stiffness_n_m_per_rad, joint.stiffness_n_per_m * DelayedJoint::kLever_m * DelayedJoint::kLever_m,
              1e-12);
}

TEST(DelayedJoint, GetsSofterWithTheDelayAndNeverStifferThanItsLimit) {
  double before = std::numeric_limits<double>::infinity();
  for (const int loop_ms : {0, 1, 10, 25, 50, 100, 200, 300, 1000}) {
    const Joint joint = DelayedJoint::joint(std::chrono::milliseconds(loop_ms), Duration{0}, Vec3::UnitX());
    EXPECT_LE(joint.axis_stiffness_n_per_m, before);
    EXPECT_LE(joint.axis_stiffness_n_per_m, DelayedJoint::kMaxStiffness_n_per_m);
    EXPECT_GE(joint.axis_stiffness_n_per_m, joint.stiffness_n_per_m);
    EXPECT_TRUE(is_usable(joint));
    before = joint.axis_stiffness_n_per_m;
  }
}

TEST(DelayedJoint, AllWhoShareABodyAreAsSoftAcross) {
  const Duration slow = 2 * kHundred_ms;
  const Joint mine = DelayedJoint::joint(kHundred_ms, slow, Vec3::UnitX());
  const Joint theirs = DelayedJoint::joint(slow, slow, Vec3::UnitX());
  EXPECT_EQ(mine.stiffness_n_per_m, theirs.stiffness_n_per_m);
  EXPECT_GT(mine.axis_stiffness_n_per_m, theirs.axis_stiffness_n_per_m);
}

/// Steps of 1 ms of a delayed joint.
struct SteppedJoint {
  void step(const DelayedJoint::Use& use, Duration weight_wait = Duration{0}) {
    joint.step(now, kPeriod, use, weight_wait);
    now += kPeriod;
  }
  static constexpr Duration kPeriod{std::chrono::milliseconds(1)};
  DelayedJoint joint{};
  Duration now{std::chrono::seconds(3)};
};

TEST(DelayedJoint, ItsShareRisesAndFallsEvenlyAndWholly) {
  SteppedJoint stepped;
  double before = 0, steepest = 0;
  const auto step = [&](bool is_shared) {
    stepped.step({.is_shared = is_shared});
    steepest = std::max(steepest, std::abs(stepped.joint.share() - before));
    before = stepped.joint.share();
  };
  for (int i = 0; i < 101; ++i) step(true);
  EXPECT_EQ(stepped.joint.share(), 1);
  for (int i = 0; i < 201; ++i) step(false);
  EXPECT_EQ(stepped.joint.share(), 0);
  // Of 3 u² − 2 u³ in 100 ms: 1.5 / 100 a tick in the middle.
  EXPECT_LT(steepest, 0.0151);
}

TEST(DelayedJoint, KeepsItsShareForAsLongAsSharingIsKept) {
  SteppedJoint stepped{.joint = DelayedJoint(kHundred_ms)};
  for (int i = 0; i < 101; ++i) stepped.step({.is_shared = true});
  for (int i = 0; i < 99; ++i) stepped.step({.is_shared = false});
  EXPECT_EQ(stepped.joint.share(), 1) << "a hand that comes back within that time switches nothing";
  stepped.step({.is_shared = false});
  EXPECT_LT(stepped.joint.share(), 1);
  stepped.joint.disengage();
  stepped.step({.is_shared = false});
  EXPECT_EQ(stepped.joint.share(), 0);
}

TEST(DelayedJoint, TheCopyOfWhoAloneHoldsTheBodyBearsItsWeight) {
  SteppedJoint stepped;
  for (int i = 0; i < 101; ++i) stepped.step({.is_held = true});
  EXPECT_EQ(stepped.joint.weight_on_copy(), 1);
  for (int i = 0; i < 50; ++i) stepped.step({.is_held = true, .other_holders = 1});
  EXPECT_NEAR(stepped.joint.weight_on_copy(), 0.5, 1e-12) << "goes over evenly when another takes it too";
  stepped.step({.is_held = false, .other_holders = 1});
  EXPECT_EQ(stepped.joint.weight_on_copy(), 0) << "at once when it is let go";
}

TEST(DelayedJoint, AWeightGoesOverOnlyWhenTheOtherEndKnowsWhoBearsIt) {
  SteppedJoint stepped;
  stepped.step({.is_held = true, .other_holders = 1});
  for (int i = 0; i < 100; ++i) stepped.step({.is_held = true}, kHundred_ms);
  EXPECT_EQ(stepped.joint.weight_on_copy(), 0);
  stepped.step({.is_held = true}, kHundred_ms);
  EXPECT_GT(stepped.joint.weight_on_copy(), 0);
}

/// A tool that presses on a free cube, and a user whose client has the cube `offset` from there.
class JoinedCopies : public testing::Test {
 protected:
  JoinedCopies() : world(client_world(world_of({cube(Vec3::Zero(), 0.3)}, {ball_tool({-0.026, 0, 0})}), &external)) {
    world.activate_tool(0);
    world.set_handle(0, at({-0.02, 0, 0}));
  }

  void join(const Vec3& offset, double share, const Joint& joint = kJoint) {
    const std::array<CopyTarget, 1> copies{CopyTarget{kBody, at(offset), Vec3::Zero(), Vec3::Zero()}};
    world.join_copies(0, at({-0.026, 0, 0}), copies, std::span<const Joint>(&joint, 1), share);
  }

  ExternalBodies external;
  World world;
};

TEST_F(JoinedCopies, WithAShareOfOneOnlyTheCopyMovesTheBody) {
  join({0, 0, 0.01}, 1);
  for (int i = 0; i < 3000; ++i) {
    join({0, 0, 0.01}, 1);
    world.step();
  }
  // The handle is 6 mm inside: had the tool pressed on, the cube would be elsewhere.
  EXPECT_NEAR((world.body(kBody).X.p - Vec3(0, 0, 0.01)).norm(), 0, 1e-5);
  EXPECT_EQ(world.touch(0).contacts, 0u);
}

TEST_F(JoinedCopies, WhatACopyBearsOfTheWeightTheJointNeedNot) {
  for (const double there : {0.0, 0.5, 1.0}) {
    WorldDescription description = world_of({cube(Vec3::Zero(), 0.3)}, {ball_tool({-0.026, 0, 0})});
    description.gravity_m_per_s2 = {0, 0, -9.81};
    World heavy = client_world(description);
    heavy.activate_tool(0);
    const CopyTarget copy{kBody, at(Vec3::Zero()), Vec3::Zero(), Vec3::Zero()};
    for (int i = 0; i < 4000; ++i) {
      heavy.join_copies(0, at({-0.026, 0, 0}), {&copy, 1}, {&kJoint, 1}, 1, {&there, 1});
      heavy.step();
    }
    const double sag_m = (1 - there) * 0.3 * 9.81 / kJoint.stiffness_n_per_m;
    EXPECT_NEAR(heavy.body(kBody).X.p.z(), -sag_m, 1e-5) << there;
    EXPECT_NEAR(heavy.tool(0).weight_work_j, -there * 0.3 * 9.81 * sag_m, 1e-7) << there;
  }
}

TEST_F(JoinedCopies, TheHandIsToldTheOppositeOfWhatTheJointDoes) {
  join({0.001, 0.002, 0.003}, 1);
  world.step();
  // At rest, before anything has moved by more than a step: k d, with the damper's share of that step.
  const Vec3 on_hand = world.tool(0).wrench_on_hand_W.f;
  EXPECT_NEAR((on_hand + 200 * Vec3(0.001, 0.002, 0.003)).norm(), 0, 0.2 * on_hand.norm());
}

TEST_F(JoinedCopies, TheirWorkIsTheEnergyOfTheBody) {
  for (int i = 0; i < 20; ++i) {
    join({0.01, 0, 0}, 1, kSpring);
    world.step();
  }
  const double kinetic_j = 0.5 * 0.3 * world.body(kBody).V.v.squaredNorm();
  EXPECT_GT(kinetic_j, 1e-4);
  // The work of the mean force over the way of the step, against v²: implicit Euler loses m (Δv)²/2 a step.
  EXPECT_NEAR(world.tool(0).copies_work_j, kinetic_j, 0.1 * kinetic_j);
  EXPECT_EQ(world.tool(0).energy_into_world_j, world.tool(0).copies_work_j);
}

TEST_F(JoinedCopies, ABrakeHoldsBackWhatMovesAndNotWhatRests) {
  join({0, 0, 0.003}, 1, kSpring);
  world.step();
  const double free_n = world.tool(0).wrench_on_hand_W.f.z();
  const double free_m_per_s = world.body(kBody).V.v.z();
  for (const double brake_n_s_per_m : {100.0, 0.0}) {
    world.set_body(kBody, at(Vec3::Zero()));
    world.brake(0, brake_n_s_per_m);
    join({0, 0, 0.003}, 1, kSpring);
    world.step();
    const double speed = world.body(kBody).V.v.z();
    EXPECT_LE(speed, brake_n_s_per_m > 0 ? 0.9 * free_m_per_s : free_m_per_s);
    // The joint's own force changes a little with where the body gets.
    EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.z() - free_n, brake_n_s_per_m * speed, 0.02 * std::abs(free_n));
  }
}

TEST_F(JoinedCopies, SomebodyWithACopyIsAHandOnTheBody) {
  EXPECT_EQ(world.hands_on(kBody), 0u);
  join({0, 0, 0}, 0.5);
  EXPECT_EQ(world.hands_on(kBody), 1u);
  EXPECT_FALSE(external.contains(0));
  world.join_copies(0, RigidState{}, {}, {}, 0);
  world.deactivate_tool(0);
  EXPECT_EQ(world.hands_on(kBody), 0u);
}

TEST_F(JoinedCopies, ATouchComesBackAfterwards) {
  join({0, 0, 0}, 1);
  run(world, 10);
  world.join_copies(0, RigidState{}, {}, {}, 0);
  run(world, 20);
  EXPECT_GT(world.touch(0).contacts, 0u);
}

TEST_F(JoinedCopies, NumbersThatAreNotFiniteAreIgnored) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  join({nan, 0, 0}, 1);
  run(world, 10);
  EXPECT_EQ(world.hands_on(kBody) & 0u, 0u);
  join({0, 0, 0}, nan);
  Joint broken = kJoint;
  broken.stiffness_n_per_m = nan;
  join({0, 0, 0}, 1, broken);
  run(world, 10);
  EXPECT_TRUE(is_finite(world.body(kBody).X));
  EXPECT_LT(world.body(kBody).X.p.norm(), 0.1);
}

TEST_F(JoinedCopies, AGripMovesNoFasterThanItIsTold) {
  world.hold(0, kBody, {{-0.026, 0, 0}, Quat::Identity()});
  const Pose there{{-0.016, 0, 0}, Quat::Identity()};
  world.move_grip(0, there, 0.001);
  const Vec3 place = world.body(kBody).X.inverse() * world.tool(0).tool.X.p;
  EXPECT_NEAR(place.x(), -0.025, 1e-9);
  for (int i = 0; i < 20; ++i) world.move_grip(0, there, 0.001);
  EXPECT_NEAR((world.body(kBody).X.inverse() * world.tool(0).tool.X.p).x(), -0.016, 1e-9);
}

}  // namespace
}  // namespace tandem::physics
