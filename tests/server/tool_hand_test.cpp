// The pull of a hand on its tool: action and reaction, and the account of its work.
#include "server/tool_hand.hpp"

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace tandem {
namespace {

Vec3 random_vector(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

RigidState random_state(Random& random) {
  return {{random_vector(random, 0.01), quaternion_of(random_vector(random, 0.5))},
          {random_vector(random, 0.3), random_vector(random, 2)}};
}

TEST(ToolHand, WrenchesOnHandAndToolSumToZeroAboutAnyPoint) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  ToolHand hand("", CouplingParameters{});
  for (int i = 0; i < 1000; ++i) {
    const RigidState handle = random_state(random);
    const RigidState tool = random_state(random);
    hand.set_handle(handle);
    const Wrench on_tool = hand.pull(tool);
    const Wrench on_hand = hand.wrench_on_hand_W();
    const Vec3 origin = random_vector(random, 1);
    const Vec3 force = on_tool.f + on_hand.f;
    const Vec3 torque =
        on_tool.t + (tool.X.p - origin).cross(on_tool.f) + on_hand.t + (handle.X.p - origin).cross(on_hand.f);
    ASSERT_LT(force.norm(), 1e-12) << "seed " << kSeed << " draw " << i;
    ASSERT_LT(torque.norm(), 1e-12) << "seed " << kSeed << " draw " << i;
  }
}

TEST(ToolHand, WorkOfASpringThatRelaxesIsTheRectangleUnderItsStartForce) {
  CouplingParameters coupling;
  coupling.stiffness_n_per_m = 100;
  ToolHand hand("", coupling);
  hand.set_handle({{Vec3(0.02, 0, 0), Quat::Identity()}, Twist{}});
  hand.pull({});                                        // 2 N
  hand.account({Vec3(0.005, 0, 0), Quat::Identity()});  // moved with the force
  EXPECT_NEAR(hand.energy_into_world_j(), 0.01, 1e-15);
  hand.account({Vec3(-0.001, 0, 0), Quat::Identity()});  // moved against it
  EXPECT_NEAR(hand.energy_from_world_j(), 0.002, 1e-15);
  EXPECT_NEAR(hand.energy_into_world_j(), 0.01, 1e-15);
}

TEST(ToolHand, TurningIsPartOfTheWork) {
  CouplingParameters coupling;
  coupling.stiffness_n_m_per_rad = 0.5;
  ToolHand hand("", coupling);
  hand.set_handle({{Vec3::Zero(), quaternion_of(Vec3(0, 0, 0.2))}, Twist{}});
  hand.pull({});
  hand.account({Vec3::Zero(), quaternion_of(Vec3(0, 0, 0.1))});
  EXPECT_NEAR(hand.energy_into_world_j(), 0.5 * 0.2 * 0.1, 1e-12);
}

TEST(ToolHand, AnAnchorPullsTheToolButNotTheHand) {
  ToolHand hand("", CouplingParameters{});
  hand.anchor_at({Vec3(0.01, 0, 0), Quat::Identity()});
  EXPECT_GT(hand.pull({}).f.x(), 1);
  EXPECT_EQ(hand.wrench_on_hand_W().f, Vec3::Zero());
  hand.account({Vec3(0.005, 0, 0), Quat::Identity()});
  EXPECT_EQ(hand.energy_into_world_j(), 0) << "no hand did this work";
}

TEST(ToolHand, SaturationIsReportedAtTheLimitOnly) {
  CouplingParameters coupling;  // 300 N/m up to 6.5 N
  ToolHand hand("", coupling);
  hand.set_handle({{Vec3(0.0216, 0, 0), Quat::Identity()}, Twist{}});
  hand.pull({});
  EXPECT_FALSE(hand.is_saturated());
  hand.set_handle({{Vec3(0.0217, 0, 0), Quat::Identity()}, Twist{}});
  hand.pull({});
  EXPECT_TRUE(hand.is_saturated());
}

}  // namespace
}  // namespace tandem
