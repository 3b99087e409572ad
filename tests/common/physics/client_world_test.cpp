// Tests functions of a world that only clients use: bodies that follow the server, small corrections, the set of tools
// that touch a body, and energies.
#include <gtest/gtest.h>

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/physics/molecular_forces.hpp"
#include "tests/common/physics/world_support.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::physics {
namespace {

constexpr BodyId kClientWorldA{1};
constexpr BodyId kB{2};

TEST(FollowedBodies, KeepTheReceivedVelocityWhateverActsOnThem) {
  WorldDescription description = world_of({cube({0, 0, 1}, 0.3), cube({0, 0, 1.03}, 0.3)}, {ball_tool({0, 0, 9})});
  description.gravity_m_per_s2 = {0, 0, -9.81};
  description.bodies[0].anchor = Joint{300, 3, 1, 0.01};
  World world = client_world(description);
  world.set_body(kClientWorldA, {{{0, 0, 1}, Quat::Identity()}, {{0.1, 0, 0}, {0, 0, 2}}});
  EXPECT_EQ(run(world, 500), 0U);
  const RigidState a = world.body(kClientWorldA);
  EXPECT_LT((a.X.p - Vec3(0.05, 0, 1)).norm(), 1e-12);
  EXPECT_LT((rotation_vector(a.X.q) - Vec3(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((a.V.v - Vec3(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(world.body(kB).X.p, Vec3(0, 0, 1.03)) << "followed bodies may overlap";
}

TEST(ClientWorld, ATouchedBodyIsMovedByTheToolAndThenFollowsAgain) {
  WorldDescription description = world_of({cube(Vec3::Zero(), 0.3)}, {ball_tool({-0.03, 0, 0})});
  ExternalBodies external;
  World world = client_world(description, &external);
  world.activate_tool(0);
  for (int i = 0; i < 400; ++i) {
    world.set_handle(0, at({-0.03 + 1e-4 * i, 0, 0}));
    world.step();
  }
  EXPECT_FALSE(external.contains(0));
  EXPECT_GT(world.body(kClientWorldA).X.p.x(), 0.005);
  for (int i = 0; i < 2000; ++i) {
    world.set_handle(0, at({-0.1, 0, 0}));
    world.step();
  }
  EXPECT_TRUE(external.contains(0));
  world.set_body(kClientWorldA, at({0.5, 0, 0}));
  run(world, 10);
  EXPECT_EQ(world.body(kClientWorldA).X.p, Vec3(0.5, 0, 0));
}

TEST(ClientWorld, KeepsABodyImplicitForTheRequestedTime) {
  ExternalBodies external;
  World world = client_world(world_of({cube(Vec3::Zero(), 0.3), table()}, {ball_tool({0, 0, 1})}), &external);
  world.keep_implicit(kClientWorldA, 0.1);
  world.keep_implicit(kB, 0.1);
  EXPECT_EQ(external, ExternalBodies{1}) << "the static one is never implicit";
  run(world, 99);
  EXPECT_EQ(external, ExternalBodies{1});
  run(world, 300);
  EXPECT_EQ(external, (ExternalBodies{0, 1}));
}

TEST(ClientWorld, ShiftsAreAboutTheCentreOfMassAndSeenByNoAccount) {
  WorldDescription description = world_of({cube({1, 0, 0}, 0.3)}, {ball_tool({0, 0, 1})});
  description.bodies[0].mass = mass_of(0.3, 0.01, {0.01, 0, 0});
  World world = client_world(description);
  world.activate_tool(0);
  world.set_handle(0, at({0, 0, 1}));
  world.step();
  const Quat turn = quaternion_of({0, 0, 0.2});
  world.shift_body(kClientWorldA, {{0, 0, 0.001}, turn}, {{0.5, 0, 0}, {0, 0, 1}});
  const Vec3 centre(1.01, 0, 0.001);
  EXPECT_LT((world.body(kClientWorldA).X.p - (centre + turn * Vec3(-0.01, 0, 0))).norm(), 1e-15);
  EXPECT_LT((world.body(kClientWorldA).V.v - Vec3(0.5, 0, 0) - Vec3(0, 0, 1).cross(turn * Vec3(-0.01, 0, 0))).norm(),
            1e-15);
  world.shift_tool(0, {{0.002, 0, 0}, Quat::Identity()}, {});
  EXPECT_LT((world.tool(0).tool.X.p - Vec3(0.002, 0, 1)).norm(), 1e-15);
  EXPECT_EQ(world.tool(0).energy_into_world_j, 0);
  EXPECT_EQ(world.tool(0).energy_from_world_j, 0);
}

TEST(ClientWorld, AToolHoldsABodyOutOfReachWhenSomebodyElseDecidedThat) {
  World world = client_world(world_of({cube({1, 0, 0}, 0.3), table()}, {ball_tool({0, 0, 1})}));
  world.activate_tool(0);
  EXPECT_EQ(world.grab(0, kClientWorldA), GrabResult::kOutOfReach);
  world.hold(0, kB, Pose{});
  EXPECT_FALSE(world.tool(0).held.is_valid()) << "static";
  world.hold(0, kClientWorldA, {{0, 0.02, 0}, Quat::Identity()});
  EXPECT_EQ(world.tool(0).held, kClientWorldA);
  EXPECT_LT((world.tool(0).tool.X.p - Vec3(1, 0.02, 0)).norm(), 1e-15);
  EXPECT_EQ(world.hands_on(kClientWorldA), 1U);
  world.release(0);
  EXPECT_EQ(world.hands_on(kClientWorldA), 0U);
}

/// Scene of three tools and three cubes on a table. The first tool touches the left one of two adjacent cubes. The
/// second tool presses the third cube, and the third tool is far away.
TEST(HandsOn, CountHandsThroughMovingBodiesOnly) {
  const double gap = 1e-5;
  WorldDescription description =
      world_of({cube({0, 0, 0.02}, 0.3), cube({kCubeEdge_m + gap, 0, 0.02}, 0.3), table(), cube({0.3, 0, 0.02}, 0.3)},
               {ball_tool({-0.03, 0, 0.02}), ball_tool({0.3, 0, 0.05}), ball_tool({0, 0, 2})});
  // Damping keeps a pushed body in contact with its tool.
  for (BodyDescription& body : description.bodies) body.traits.linear_damping_per_s = 50;
  World world = client_world(description);
  for (const std::size_t tool : {0U, 1U, 2U}) world.activate_tool(tool);
  for (int i = 0; i < 500; ++i) {
    // All cubes lie on the table. Hands are counted through touching bodies that can move. The table cannot move, so it
    // must not connect the cubes.
    world.set_handle(0, at({-0.03 + 5e-5 * i, 0, 0.02}));
    world.set_handle(1, at({0.3, 0, 0.04}));
    world.set_handle(2, at({0, 0, 2}));
    world.step();
  }
  EXPECT_EQ(world.hands_on(kClientWorldA), 1U);
  EXPECT_EQ(world.hands_on(kB), 1U) << "through the first cube";
  EXPECT_EQ(world.hands_on(BodyId{3}), 0U) << "the table does not move";
  EXPECT_EQ(world.hands_on(BodyId{4}), 2U);
  world.hold(2, kB, Pose{});
  world.step();
  EXPECT_EQ(world.hands_on(kClientWorldA) & 4U, 4U);
  EXPECT_EQ(world.hands_on(BodyId{9}), 0U) << "not there";
}

TEST(SoftContactFromOutside, PushesAToolWithItsLinearisedForce) {
  World world = client_world(world_of({cube({1, 0, 0}, 0.3)}, {ball_tool(Vec3::Zero())}));
  world.activate_tool(0);
  SoftContact soft;
  soft.wrench_W.f = {0, 0, 0.6};
  soft.stiffness.topLeftCorner<3, 3>() = 100 * Eigen::Matrix3d::Identity();
  soft.trust_radius_m = 0.01;
  soft.lever_m = 0.005;
  for (int i = 0; i < 3000; ++i) {
    world.set_handle(0, at(Vec3::Zero()));
    world.set_soft_contact(0, soft);
    ASSERT_EQ(world.step(), 0U);
  }
  const double z = 0.6 / (300 + 100);
  EXPECT_NEAR(world.tool(0).tool.X.p.z(), z, 1e-9);
  EXPECT_NEAR(world.touch(0).soft_force_n, 300 * z, 1e-6);
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.z(), 300 * z, 1e-6);
  world.deactivate_tool(0);
  world.activate_tool(0);
  EXPECT_EQ(world.touch(0).soft_force_n, 0) << "the next user's tool is elsewhere";
}

TEST(StoredEnergy, OfAFreeTiedWorldNeverRises) {
  WorldDescription description = world_of({cube({1, 0, 0}, 0.3)}, {ball_tool(Vec3::Zero())});
  description.bodies[0].anchor = Joint{300, 0, 1, 0};
  World world = server_world(description);
  world.activate_tool(0);
  world.hold(0, kClientWorldA, {{0, 0.02, 0}, Quat::Identity()});
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 2000; ++i) {
    world.set_handle(0, at({1.01, 0.03, 0.01}));
    world.step();
    const double now = world.stored_energy_j();
    ASSERT_LE(now, last + 1e-9) << "step " << i;
    last = now;
  }
}

std::shared_ptr<const docking::Molecule> argon() {
  auto molecule = std::make_shared<docking::Molecule>();
  molecule->positions_angstrom = {Vec3::Zero()};
  molecule->sigma_angstrom = {3.4};
  molecule->epsilon_kj_per_mol = {1.0};
  molecule->charge_e = {0};
  molecule->mass_u = {39.95};
  molecule->atom_names.resize(1);
  molecule->residue_names.resize(1);
  molecule->types = {"test"};
  return molecule;
}

TEST(StoredEnergy, HasTheFieldsForceAsItsSlope) {
  WorldDescription description = world_of({{}, {}}, {ball_tool({0, 0, 9})});
  for (BodyDescription& body : description.bodies) {
    body.mass = mass_of(0.1, 0.01);
    body.molecule = argon();
  }
  description.metres_per_angstrom = 0.01;
  description.newtons_per_kcal_per_mol_angstrom = 0.5;
  World world = client_world(description);
  const auto energy_at = [&world](double x_m) {
    world.set_body(kB, at({x_m, 0, 0}));
    world.step();
    return world.stored_energy_j();
  };
  MolecularForces forces(description);
  for (const double x_m : {0.036, 0.038, 0.045, 0.06}) {
    const std::array<Pose, 2> poses{Pose{}, {{x_m, 0, 0}, Quat::Identity()}};
    std::array<Wrench, 2> wrenches{};
    ASSERT_FALSE(forces.add_wrenches(poses, wrenches));
    // Step of the finite difference. It is so wide that rounding of the field to single precision has no effect.
    const double slope = (energy_at(x_m + 3e-5) - energy_at(x_m - 3e-5)) / 6e-5;
    EXPECT_NEAR(wrenches[1].f.x(), -slope, 1e-3 * std::abs(slope) + 5e-6) << x_m;
  }
}

TEST(ClientWorld, AStepAllocatesNothingForAnyRequest) {
  WorldDescription description =
      world_of({cube({0, 0, 0.02}, 0.3), cube({0.2, 0, 0.02}, 0.3), table()}, {ball_tool({-0.03, 0, 0.02})});
  description.bodies[1].anchor = Joint{300, 3, 1, 0.01};
  World world = client_world(description);
  world.activate_tool(0);
  const auto step = [&world](int i) {
    world.set_handle(0, at({-0.03 + 5e-5 * i, 0, 0.02}));
    world.brake(0, i % 100 < 50 ? 3 : 0);
    world.shift_body(kClientWorldA, {{1e-6, 0, 0}, Quat::Identity()}, {});
    world.keep_implicit(kB, 0.01);
    world.set_soft_contact(0, {});
    world.step();
    return world.hands_on(kClientWorldA) + (world.stored_energy_j() > 1e9 ? 1U : 0U);
  };
  for (int i = 0; i < 50; ++i) step(i);
  const std::uint64_t before = test::allocation_count();
  std::uint32_t hands = 0;
  for (int i = 50; i < 600; ++i) hands |= step(i);
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_EQ(hands, 1U);
}

}  // namespace
}  // namespace tandem::physics
