// Tests the force between a hand and its tool: action and reaction, and the balance of the work.
#include "common/physics/tool_hand.hpp"

#include <gtest/gtest.h>

#include "common/base/random.hpp"
#include "proto/coupling_fields.hpp"
#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {
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
  ToolHand hand("spring-damper", haptics::CouplingParameters{});
  for (int i = 0; i < 1000; ++i) {
    const RigidState handle = random_state(random);
    const RigidState tool = random_state(random);
    const Wrench on_tool{random_vector(random, 5), random_vector(random, 0.2)};
    hand.set_handle(handle);
    hand.settle({}, tool, on_tool);
    const Wrench on_hand = hand.wrench_on_hand_W();
    const Vec3 origin = random_vector(random, 1);
    const Vec3 force = on_tool.f + on_hand.f;
    const Vec3 torque =
        on_tool.t + (tool.X.p - origin).cross(on_tool.f) + on_hand.t + (handle.X.p - origin).cross(on_hand.f);
    ASSERT_LT(force.norm(), 1e-12) << "seed " << kSeed << " draw " << i;
    ASSERT_LT(torque.norm(), 1e-12) << "seed " << kSeed << " draw " << i;
  }
}

TEST(ToolHand, WorkIsTheWrenchOfTheStepTimesItsWay) {
  ToolHand hand("spring-damper", haptics::CouplingParameters{});
  hand.set_handle({{Vec3(0.02, 0, 0), Quat::Identity()}, Twist{}});
  const Wrench two_newtons{Vec3(2, 0, 0), Vec3::Zero()};
  hand.settle({}, {{Vec3(0.005, 0, 0), Quat::Identity()}, {}}, two_newtons);  // the tool moves along the force
  EXPECT_NEAR(hand.energy_into_world_j(), 0.01, 1e-15);
  hand.settle({}, {{Vec3(-0.001, 0, 0), Quat::Identity()}, {}}, two_newtons);  // the tool moves against the force
  EXPECT_NEAR(hand.energy_from_world_j(), 0.002, 1e-15);
  EXPECT_NEAR(hand.energy_into_world_j(), 0.01, 1e-15);
}

TEST(ToolHand, TurningIsPartOfTheWork) {
  ToolHand hand("spring-damper", haptics::CouplingParameters{});
  hand.set_handle({{Vec3::Zero(), quaternion_of(Vec3(0, 0, 0.2))}, Twist{}});
  hand.settle({}, {{Vec3::Zero(), quaternion_of(Vec3(0, 0, 0.1))}, {}}, {Vec3::Zero(), Vec3(0, 0, 0.1)});
  EXPECT_NEAR(hand.energy_into_world_j(), 0.1 * 0.1, 1e-12);
}

TEST(ToolHand, AnAnchorPullsTheToolButNotTheHand) {
  ToolHand hand("spring-damper", haptics::CouplingParameters{});
  hand.anchor_at({Vec3(0.01, 0, 0), Quat::Identity()});
  ASSERT_TRUE(hand.pulls());
  const contact::SolverCoupling coupling = hand.coupling(0, {});
  EXPECT_GT(haptics::coupling_wrenches(*coupling.law, coupling.X_WH, coupling.V_WH, coupling.X_WT, {}).on_tool_W.f.x(),
            1);
  hand.settle({}, {{Vec3(0.005, 0, 0), Quat::Identity()}, {}}, {Vec3(3, 0, 0), Vec3::Zero()});
  EXPECT_EQ(hand.wrench_on_hand_W().f, Vec3::Zero());
  EXPECT_EQ(hand.energy_into_world_j(), 0) << "no hand did this work";
}

TEST(ToolHand, SaturationIsReportedAtTheLimitOnly) {
  ToolHand hand("spring-damper", {.saturation_softness = 0});  // the law is linear up to 6.5 N
  hand.set_handle({});
  hand.settle({}, {}, {Vec3(6.4999, 0, 0), Vec3::Zero()});
  EXPECT_FALSE(hand.is_saturated());
  hand.settle({}, {}, {Vec3(6.5, 0, 0), Vec3::Zero()});
  EXPECT_TRUE(hand.is_saturated());
}

TEST(ToolHand, SaturationIsReportedPastHalfOfItsBend) {
  ToolHand hand("spring-damper", {.force_limit_n = 10, .saturation_softness = 0.2});  // the curve bends above 8 N
  hand.set_handle({});
  hand.settle({}, {}, {Vec3(8.9, 0, 0), Vec3::Zero()});
  EXPECT_FALSE(hand.is_saturated());
  hand.settle({}, {}, {Vec3(9.1, 0, 0), Vec3::Zero()});
  EXPECT_TRUE(hand.is_saturated());
}

TEST(ToolHand, ANewCouplingIsReachedInATenthOfASecondAndByNoStep) {
  const haptics::CouplingParameters before{.stiffness_n_per_m = 100};
  haptics::CouplingParameters after;
  for (const proto::CouplingField& field : proto::kCouplingFields) after.*field.value = 1.2 * before.*field.value;
  ToolHand hand("spring-damper", before);
  hand.set_coupling(*haptics::find_coupling_law("spring-damper"), after);
  double last = before.stiffness_n_per_m;
  for (int i = 0; i < 100; ++i) {
    hand.advance(1e-3);
    ASSERT_NEAR(hand.parameters().stiffness_n_per_m - last, 0.2, 1e-9) << i;
    last = hand.parameters().stiffness_n_per_m;
  }
  EXPECT_EQ(hand.parameters(), after) << "every coefficient";
  hand.set_coupling(*haptics::find_coupling_law("spring-damper"), before);
  hand.reset(before);
  EXPECT_EQ(hand.parameters(), before) << "a new user starts with it";
}

TEST(ToolHandEnergy, IsHalfKDSquaredOfASpring) {
  haptics::CouplingParameters parameters;
  parameters.force_limit_n = parameters.torque_limit_n_m = 100;
  ToolHand hand("spring-damper", parameters);
  hand.set_handle({{{0.01, 0, 0.02}, quaternion_of({0, 0.4, 0})}, {{1, 2, 3}, {}}});
  const double expected = 0.5 * parameters.stiffness_n_per_m * 5e-4 + 0.5 * parameters.stiffness_n_m_per_rad * 0.16;
  EXPECT_NEAR(hand.stored_energy_j(Pose{}), expected, 1e-12);
}

TEST(ToolHandEnergy, HasTheForceAsItsSlopeForEveryLawWithAPotential) {
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    if (!law.is_passive) continue;
    ToolHand hand(law.name, {});
    for (const double d : {0.002, 0.01, 0.02, 0.05}) {
      hand.set_handle(at({d, 0, 0}));
      const auto energy_at = [&hand](double x) { return hand.stored_energy_j({{x, 0, 0}, Quat::Identity()}); };
      const double slope = (energy_at(-1e-5) - energy_at(1e-5)) / 2e-5;
      const contact::SolverCoupling c = hand.coupling(0, Pose{});
      const double force = haptics::coupling_wrenches(*c.law, c.X_WH, {}, c.X_WT, {}).on_tool_W.f.x();
      // Tolerance: the stored energy is integrated by Simpson's rule, which is less accurate where the curve bends near
      // the force limit.
      EXPECT_NEAR(slope, force, 2e-3 * force) << law.name << " at " << d;
    }
  }
}

}  // namespace
}  // namespace tandem::physics
