// What joins a body to its copy: how much of it, beside the hand's coupling, and what the accounts say.
#include "common/physics/joints/joint.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "common/base/random.hpp"
#include "common/contact/coupling_term.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/physics/tool_hand.hpp"
#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {
namespace {

constexpr BodyId kBody{1};
const Joint kJoint{200, 20, 0.2, 0.02};

Vec3 random_vector(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

haptics::AdaptiveFit some_fit() {
  haptics::AdaptiveFit fit;
  fit.mass_low_kg = 0.01;
  fit.mass_high_kg = 1;
  fit.stiffness_n_per_m.c = {300, 0, 0, 0};
  fit.damping_n_s_per_m.c = {3, 0, 0, 0};
  return fit;
}

TEST(ToolHandStrength, ScalesTheForceOfEveryLawAndItsSlopes) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    ToolHand whole(law.name, {}), part(law.name, {});
    part.set_strength(0.3);
    for (int i = 0; i < 100; ++i) {
      const RigidState handle{{random_vector(random, 0.05), quaternion_of(random_vector(random, 1))},
                              {random_vector(random, 0.5), random_vector(random, 5)}};
      whole.set_handle(handle);
      part.set_handle(handle);
      contact::CouplingTerm all(whole.coupling(0, Pose{}), contact::SolverBody{}, 1e-3);
      contact::CouplingTerm share(part.coupling(0, Pose{}), contact::SolverBody{}, 1e-3);
      const Wrench expected = all.evaluate(Twist{}) * 0.3;
      const Wrench found = share.evaluate(Twist{});
      ASSERT_GT(expected.f.norm() + expected.t.norm(), law.tool == haptics::ToolDynamics::kAtHandle ? -1 : 0);
      ASSERT_LT((found.f - expected.f).norm(), 1e-14) << law.name;
      ASSERT_LT((found.t - expected.t).norm(), 1e-14) << law.name;
      const Mat6 slope = all.derivative();
      ASSERT_LT((share.derivative() - 0.3 * slope).norm(), 1e-12 * (1 + slope.norm())) << law.name;
    }
  }
}

TEST(ToolHandEnergy, IsHalfKDSquaredOfASpring) {
  haptics::CouplingParameters parameters;
  parameters.force_limit_n = parameters.torque_limit_n_m = 100;
  ToolHand hand("spring-damper", parameters);
  hand.set_handle({{{0.01, 0, 0.02}, quaternion_of({0, 0.4, 0})}, {{1, 2, 3}, {}}});
  const double expected = 0.5 * parameters.stiffness_n_per_m * 5e-4 + 0.5 * parameters.stiffness_n_m_per_rad * 0.16;
  EXPECT_NEAR(hand.stored_energy_j(Pose{}), expected, 1e-12);
  hand.set_strength(0.25);
  EXPECT_NEAR(hand.stored_energy_j(Pose{}), 0.25 * expected, 1e-12);
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
      // Simpson's rule over the bend at the limit.
      EXPECT_NEAR(slope, force, 2e-3 * force) << law.name << " at " << d;
    }
  }
}

WorldDescription one_tool() {
  return world_of({cube({0, 0, 1}, 0.3)}, {ball_tool(Vec3::Zero())});
}

/// A user who holds the body where the tool is at first, and whose client has a copy of it.
struct Holding {
  explicit Holding(const WorldDescription& description) : world(client_world(description)) {
    world.activate_tool(0);
    world.hold(0, kBody, {Vec3::Zero(), Quat::Identity()});
  }
  void join(const Vec3& copy_p, double share, const Joint& joint = kJoint) {
    const CopyTarget copy{kBody, at(copy_p), Vec3::Zero(), Vec3::Zero()};
    world.join_copies(0, at(copy_p), {&copy, 1}, {&joint, 1}, share);
  }

  World world;
};
const Vec3 kStart(0, 0, 1);  ///< of the body

TEST(JoinCopies, ShareOfNothingChangesNoBit) {
  Holding joined(one_tool()), alone(one_tool());
  for (int i = 0; i < 200; ++i) {
    for (Holding* holding : {&joined, &alone}) {
      holding->world.set_handle(0, at(kStart + 1e-4 * i * Vec3::UnitX(), {0.1, 0, 0}));
    }
    joined.join({1, 2, 3}, 0);
    joined.world.step();
    alone.world.step();
    ASSERT_EQ(joined.world.body(kBody).X.p, alone.world.body(kBody).X.p);
    ASSERT_EQ(joined.world.tool(0).wrench_on_hand_W.f, alone.world.tool(0).wrench_on_hand_W.f);
    ASSERT_EQ(joined.world.tool(0).energy_into_world_j, alone.world.tool(0).energy_into_world_j);
  }
}

/// Where a held body comes to rest between its handle at 0 and the copy at 1 cm.
double rest_m(const std::string& law, double share) {
  WorldDescription description = one_tool();
  description.coupling.law = law;
  description.coupling.dynamics = haptics::find_coupling_law(law)->tool;
  if (law == "adaptive") description.coupling.fit = some_fit();
  Holding holding(description);
  for (int i = 0; i < 8000; ++i) {
    holding.world.set_handle(0, at(kStart));
    holding.join(kStart + Vec3(0.01, 0, 0), share);
    EXPECT_EQ(holding.world.step() & kFaultNotFinite, 0U);
  }
  EXPECT_LT(holding.world.tool(0).wrench_on_hand_W.f.norm(), 1e-5) << "at rest both pulls balance";
  return holding.world.body(kBody).X.p.x();
}

TEST(JoinCopies, AHeldBodyRestsWhereTheSharesBalance) {
  for (const double share : {0.1, 0.5, 0.9, 1.0}) {
    const double hand = (1 - share) * 300, joint = share * kJoint.stiffness_n_per_m;
    EXPECT_NEAR(rest_m("spring-damper", share), 0.01 * joint / (hand + joint), 1e-7) << share;
    EXPECT_NEAR(rest_m("adaptive", share), 0.01 * joint / (hand + joint), 1e-7) << share;
  }
  EXPECT_NEAR(rest_m("qsa-static", 1.0), 0.01, 1e-6) << "without mass";
}

TEST(JoinCopies, TheAccountIsTheWorkOfBothPulls) {
  Holding holding(one_tool());
  double work_j = 0;
  Vec3 v = Vec3::Zero();
  for (int i = 0; i < 1000; ++i) {
    holding.world.set_handle(0, at(kStart + 0.01 * std::sin(0.01 * i) * Vec3::UnitX()));
    holding.join(kStart + 0.01 * std::cos(0.02 * i) * Vec3::UnitY(), 0.6);
    ASSERT_EQ(holding.world.step(), 0U);
    const Vec3 v_next = holding.world.body(kBody).V.v;
    // All that acts on the body is pull: f = m (v' − v)/h along h v'.
    work_j += 0.3 * (v_next - v).dot(v_next);
    v = v_next;
  }
  const ToolState tool = holding.world.tool(0);
  EXPECT_NEAR(tool.energy_into_world_j - tool.energy_from_world_j, work_j, 1e-9);
  EXPECT_GT(tool.energy_from_world_j, 1e-5);
}

TEST(JoinCopies, WithoutAHandleTheJointAlonePullsAndIsAccountedFor) {
  Holding holding(one_tool());
  for (int i = 0; i < 5000; ++i) {
    holding.join(kStart + Vec3(0.01, 0, 0), 1);
    holding.world.step();
  }
  EXPECT_NEAR(holding.world.body(kBody).X.p.x(), 0.01, 1e-7);
  EXPECT_GT(holding.world.tool(0).energy_into_world_j, 1e-4);
  EXPECT_EQ(holding.world.tool(0).wrench_on_hand_W.f, Vec3::Zero()) << "there is no hand";
}

TEST(JoinCopies, TheNextUserIsNotJoined) {
  Holding holding(one_tool());
  holding.join(kStart + Vec3(0.01, 0, 0), 1);
  holding.world.deactivate_tool(0);
  holding.world.activate_tool(0);
  run(holding.world, 500);
  EXPECT_EQ(holding.world.body(kBody).X.p, kStart);
}

TEST(JoinBody, BearsItsShareOfTheWeight) {
  for (const double share : {0.25, 0.75, 1.0}) {
    WorldDescription description = one_tool();
    description.gravity_m_per_s2 = {0, 0, -9.81};
    World world = falling_world(description);
    for (int i = 0; i < 4000; ++i) {
      world.join_body(kBody, at({0, 0, 1}), Vec3::Zero(), kJoint, share);
      ASSERT_EQ(world.step(), 0U);
    }
    const double sag_m = (1 - share) * 0.3 * 9.81 / (share * kJoint.stiffness_n_per_m);
    EXPECT_NEAR(world.body(kBody).X.p.z(), 1 - sag_m, 1e-6) << share;
  }
}

TEST(JoinBody, BearsWhatTheOtherEndDoesNot) {
  for (const double there : {0.0, 0.4, 1.0}) {
    WorldDescription description = one_tool();
    description.gravity_m_per_s2 = {0, 0, -9.81};
    World world = falling_world(description);
    for (int i = 0; i < 4000; ++i) {
      world.join_body(kBody, at({0, 0, 1}), Vec3::Zero(), kJoint, 1, there);
      ASSERT_EQ(world.step(), 0U);
    }
    const double sag_m = (1 - there) * 0.3 * 9.81 / kJoint.stiffness_n_per_m;
    EXPECT_NEAR(world.body(kBody).X.p.z(), 1 - sag_m, 1e-6) << there;
  }
}

TEST(JoinBody, FollowsAMovingTargetWithoutLag) {
  World world = client_world(one_tool());
  const double speed = 0.2;
  double t = 0;
  for (int i = 0; i < 3000; ++i, t += kStep_s) {
    world.join_body(kBody, at({speed * t, 0, 1}, {speed, 0, 0}), Vec3::Zero(), kJoint, 1);
    world.step();
  }
  // The target keeps its velocity in the step, the solver its place: no more than one step behind.
  EXPECT_NEAR(world.body(kBody).X.p.x(), speed * t, 1.1 * speed * kStep_s);
  EXPECT_NEAR(world.body(kBody).V.v.x(), speed, 1e-6);
}

TEST(JoinBody, AtAPointBesideTheOriginBringsTheWholeBodyToItsCopy) {
  World world = client_world(one_tool());
  const RigidState copy{{{0.01, -0.02, 1.01}, quaternion_of({0.2, -0.1, 0.3})}, {}};
  const Vec3 corner(0.02, 0.02, -0.02);
  world.join_body(kBody, copy, corner, kJoint, 1);
  run(world, 5000);
  EXPECT_LT((world.body(kBody).X.p - copy.X.p).norm(), 1e-6);
  EXPECT_LT(rotation_vector(world.body(kBody).X.q * copy.X.q.conjugate()).norm(), 1e-5);
}

TEST(JoinBody, BadNumbersAreNotHeard) {
  ExternalBodies external;
  World world = client_world(one_tool(), &external);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  world.join_body(kBody, at({nan, 0, 0}), Vec3::Zero(), kJoint, 1);
  world.join_body(kBody, at({0, 0, 0}), Vec3::Zero(), {-1, 0, 0, 0}, 1);
  world.join_body(kBody, at({0, 0, 0}), Vec3::Zero(), kJoint, nan);
  world.join_body(BodyId{7}, at({0, 0, 0}), Vec3::Zero(), kJoint, 1);
  EXPECT_EQ(run(world, 10), 0U);
  EXPECT_EQ(world.body(kBody).X.p, kStart);
  EXPECT_TRUE(external.contains(0));
}

TEST(JoinBody, OwnsTheBodyWhileThereIsAShareAndGivesItBack) {
  ExternalBodies external;
  World world = client_world(one_tool(), &external);
  EXPECT_TRUE(external.contains(0));
  world.join_body(kBody, at({0, 0, 1}), Vec3::Zero(), kJoint, 0.01);
  EXPECT_FALSE(external.contains(0));
  run(world, 1000);
  EXPECT_FALSE(external.contains(0));
  world.join_body(kBody, at({0, 0, 1}), Vec3::Zero(), kJoint, 0);
  run(world, 300);
  EXPECT_TRUE(external.contains(0));
}

TEST(JoinBody, IsCalmForEveryStiffnessAndMass) {
  for (const double mass_kg : {1e-3, 0.3, 50.0}) {
    for (const Joint& joint : {Joint{1e5, 0, 1e3, 0}, Joint{1e5, 1e4, 1e4, 1e3}, Joint{1, 1e4, 0.1, 1e3}}) {
      WorldDescription description = one_tool();
      description.bodies[0] = cube({0, 0, 1}, mass_kg);
      World world = client_world(description);
      world.set_body(kBody, {{{0.02, 0, 1}, quaternion_of({0.5, 0.5, 0})}, {{0.3, 0, 0}, {0, 3, 0}}});
      double last = std::numeric_limits<double>::infinity();
      for (int i = 0; i < 500; ++i) {
        world.join_body(kBody, at({0, 0, 1}), Vec3::Zero(), joint, 1);
        ASSERT_EQ(world.step() & ~kFaultSpeedLimited, 0U);
        const double now = world.stored_energy_j();
        ASSERT_LE(now, last * (1 + 1e-6) + 1e-12) << mass_kg << " kg, step " << i;
        last = now;
      }
    }
  }
}

}  // namespace
}  // namespace tandem::physics
