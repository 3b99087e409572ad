// Where a local model's energy came from: bodies that changed their owner, the field, corrections; and what is left is
// the hand's.
#include "client/model/model_ledger.hpp"

#include <gtest/gtest.h>

#include "common/docking/molecule.hpp"
#include "tests/common/physics/world_support.hpp"

namespace tandem::client {
namespace {

constexpr BodyId kA{1};
constexpr double kMass_kg = 0.5;
constexpr double kGravity = 9.81;

physics::WorldDescription one_body() {
  physics::WorldDescription description =
      physics::world_of({physics::cube({0, 0, 1}, kMass_kg)}, {physics::ball_tool({0, 0, 9})});
  description.gravity_m_per_s2 = {0, 0, -kGravity};
  return description;
}

ModelLedger ledger_of(const physics::World& world, bool is_kept = true) {
  ModelLedger ledger(world, 0, is_kept);
  ledger.add(kA);
  return ledger;
}

TEST(ModelLedger, ABodyBringsItsEnergyAndTakesItAwayAgain) {
  physics::World world = physics::client_world(one_body());
  ModelLedger ledger = ledger_of(world);
  const ModelEnergy before = ledger.energy();
  EXPECT_NEAR(before.stored_j, kMass_kg * kGravity, 1e-12) << "its own until it follows";
  ledger.give_up(0);
  EXPECT_EQ(ledger.energy().stored_j, 0);
  EXPECT_NEAR(ledger.energy().exchanged_j, -kMass_kg * kGravity, 1e-12);
  world.set_body(kA, physics::at({0, 0, 2}, {3, 0, 0}));
  ledger.follow(0);
  ledger.take(0);
  const ModelEnergy after = ledger.energy();
  EXPECT_NEAR(after.stored_j, kMass_kg * (kGravity * 2 + 4.5), 1e-12);
  EXPECT_NEAR(after.stored_j - after.exchanged_j, before.stored_j - before.exchanged_j, 1e-12);
}

// The touch is felt in the step before the body is taken over: what the tool gave it is not from outside.
TEST(ModelLedger, ABodyIsTakenOverWithTheEnergyThatItHadWhereItFollowed) {
  physics::World world = physics::client_world(one_body());
  ModelLedger ledger = ledger_of(world);
  ledger.give_up(0);
  ledger.follow(0);
  const double given_up_j = ledger.energy().exchanged_j;
  world.set_body(kA, physics::at({0, 0, 1}, {2, 0, 0}));
  ledger.take(0);
  const ModelEnergy after = ledger.energy();
  EXPECT_NEAR(after.exchanged_j - given_up_j, kMass_kg * kGravity, 1e-12);
  EXPECT_NEAR(after.stored_j, kMass_kg * (kGravity + 2), 1e-12);
}

TEST(ModelLedger, WeightThatTheServersBodyBearsIsExchanged) {
  physics::World world = physics::client_world(one_body());
  ModelLedger ledger = ledger_of(world);
  ledger.take(0);
  world.join_body(kA, physics::at({0, 0, 1}), Vec3::Zero(), physics::Joint{1000, 10, 1, 0.1}, 0.25);
  ledger.joined(0);
  const ModelEnergy energy = ledger.energy();
  EXPECT_NEAR(energy.stored_j, 0.75 * kMass_kg * kGravity, 1e-12) << "and the joint holds nothing here";
  EXPECT_NEAR(energy.exchanged_j, -0.25 * kMass_kg * kGravity, 1e-12);
}

TEST(ModelLedger, CorrectionsAreCountedButNotTakenOff) {
  physics::World world = physics::client_world(one_body());
  ModelLedger ledger = ledger_of(world);
  ledger.take(0);
  ledger.joined(0);
  world.shift_body(kA, {{0, 0, 0.01}, Quat::Identity()}, {{1, 0, 0}, Vec3::Zero()});
  ledger.corrected(0);
  EXPECT_NEAR(ledger.energy().corrected_j, kMass_kg * (0.01 * kGravity + 0.5), 1e-12);
  EXPECT_EQ(ledger.energy().exchanged_j, 0);
}

TEST(ModelLedger, IsZeroWhenItIsNotKept) {
  physics::World world = physics::client_world(one_body());
  ModelLedger ledger = ledger_of(world, false);
  ledger.give_up(0);
  ledger.take(0);
  ledger.begin_step();
  ledger.end_step();
  EXPECT_EQ(ledger.energy().stored_j, 0);
  EXPECT_EQ(ledger.energy().exchanged_j, 0);
  EXPECT_EQ(ledger.energy().field_work_j, 0);
}

TEST(ModelLedger, WhatAMoleculeGainsTheFieldLoses) {
  physics::WorldDescription description = physics::world_of(
      {physics::cube(Vec3::Zero(), 0.05), physics::cube(Vec3::Zero(), 0)}, {physics::ball_tool({0, 0, 9})});
  auto atom = std::make_shared<docking::Molecule>();
  atom->positions_angstrom = {Vec3::Zero()};
  atom->sigma_angstrom = {3.4};
  atom->epsilon_kj_per_mol = {1.0};
  atom->charge_e = {0};
  atom->mass_u = {39.95};
  atom->atom_names.resize(1);
  atom->residue_names.resize(1);
  atom->types = {"test"};
  for (physics::BodyDescription& body : description.bodies) {
    body.touch = {};
    body.molecule = atom;
  }
  description.metres_per_angstrom = 0.01;
  description.newtons_per_kcal_per_mol_angstrom = 0.5;
  description.bodies[1].X_WB.p.x() = 0.06;
  physics::World world = physics::client_world(description);
  ModelLedger ledger = ledger_of(world);
  ledger.give_up(0);
  for (int i = 0; i < 50; ++i) {
    ledger.begin_step();
    world.step();
    ledger.end_step();
  }
  ledger.follow(0);
  EXPECT_EQ(ledger.energy().field_work_j, 0) << "it follows the server, where that work is counted";
  ledger.take(0);
  for (int i = 0; i < 200; ++i) {
    world.keep_implicit(kA, 0.01);
    ledger.begin_step();
    world.step();
    ledger.end_step();
  }
  const ModelEnergy energy = ledger.energy();
  EXPECT_GT(world.body(kA).V.v.x(), 1e-3) << "it is drawn to the other";
  // From rest, N steps of semi-implicit Euler make about a share of 1/N less than the work.
  EXPECT_NEAR(energy.stored_j, energy.field_work_j, 0.02 * energy.stored_j);
  EXPECT_NEAR(energy.exchanged_j, energy.field_work_j, 1e-12) << "and was taken over at rest";
}

TEST(World, ItsEnergyIsThatOfItsBodiesAndTools) {
  physics::WorldDescription description = one_body();
  description.bodies[0].anchor = physics::Joint{300, 3, 1, 0.01};
  description.coupling.parameters.stiffness_n_per_m = 400;
  physics::World world = physics::client_world(description);
  world.activate_tool(0);
  world.set_handle(0, physics::at({0, 0.02, 9}));
  physics::run(world, 5);
  world.set_body(kA, physics::at({0.1, 0, 1}, {1, 0, 0}));
  EXPECT_NEAR(world.energy_of_body_j(kA), kMass_kg * (kGravity + 0.5) + 0.5 * 300 * 0.01, 1e-9);
  EXPECT_GT(world.energy_of_tool_j(0), 0.01);
  const double tool_height_j = physics::kToolMass_kg * kGravity * world.tool(0).tool.X.p.z();
  const double sum_j = world.energy_of_body_j(kA) + world.energy_of_tool_j(0);
  EXPECT_NEAR(world.stored_energy_j(), sum_j, 1e-9) << "tools have no weight; it would be " << tool_height_j;
  const physics::ToolState tool = world.tool(0);
  const double stretch_m = (tool.tool.X.p - Vec3(0, 0.02, 9)).norm();
  EXPECT_NEAR(world.stored_energy_j() - world.stored_energy_j(1), 0.5 * 400 * stretch_m * stretch_m, 1e-6);
}

// One body, no weight, nothing else pulls: what its copy's joint did is what it has.
TEST(World, TheWorkOfJointsToCopiesIsTheirBodysEnergy) {
  physics::World world = physics::client_world(
      physics::world_of({physics::cube(Vec3::Zero(), kMass_kg)}, {physics::ball_tool({0, 0, 9})}));
  world.activate_tool(0);
  world.set_handle(0, physics::at({0, 0, 9}));
  const physics::Joint joint{300, 3, 1, 0.01};
  double integrator_j = 0;  // ½ m Δv² a step: what an implicit step takes beside
  for (int i = 0; i < 200; ++i) {
    const Vec3 v = world.body(kA).V.v;
    const CopyTarget copy{kA, physics::at({1e-4 * i, 0, 0}, {0.1, 0, 0}), Vec3::Zero(), Vec3::Zero()};
    world.join_copies(0, physics::at({0, 0, 9}), {&copy, 1}, {&joint, 1}, 1);
    world.step();
    integrator_j += 0.5 * kMass_kg * (world.body(kA).V.v - v).squaredNorm();
  }
  const physics::ToolState tool = world.tool(0);
  const double energy_j = world.energy_of_body_j(kA);
  EXPECT_GT(energy_j, 1e-3);
  EXPECT_NEAR(tool.copies_work_j, energy_j + integrator_j, 1e-3 * energy_j);
  EXPECT_NEAR(tool.copies_work_j, tool.energy_into_world_j - tool.energy_from_world_j, 1e-12);
}

}  // namespace
}  // namespace tandem::client
