// Tests the molecular field in the world: units, action and reaction, and the limit of the force.
#include "common/physics/molecular_forces.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "common/base/random.hpp"
#include "common/physics/followed_bodies.hpp"
#include "server/assets/mass_properties.hpp"
#include "server/room/server_world.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::physics {
namespace {

/// Returns `count` argon-like atoms on a lattice of 4 Å, with the origin at their centre of mass.
std::shared_ptr<const docking::Molecule> cluster(int count) {
  auto molecule = std::make_shared<docking::Molecule>();
  for (int i = 0; i < count; ++i) {
    const int column = i % 2, row = i / 2 % 2, layer = i / 4;
    molecule->positions_angstrom.emplace_back(4.0 * column, 4.0 * row, 4.0 * layer);
    molecule->sigma_angstrom.push_back(3.4);
    molecule->epsilon_kj_per_mol.push_back(1.0);
    molecule->charge_e.push_back(0);
    molecule->mass_u.push_back(39.95);
  }
  molecule->atom_names.resize(molecule->size());
  molecule->residue_names.resize(molecule->size());
  molecule->types.resize(molecule->size(), "test");
  const Vec3 centre = molecule->centre_of_mass_angstrom();
  for (Vec3& position : molecule->positions_angstrom) position -= centre;
  return molecule;
}

/// Returns a scene without gravity, with two bodies of `atoms` atoms each, `gap_m` apart along x. Their contact shapes
/// are tiny balls. The second body has half the mass of the first. If `held`, a tool holds each body from the start.
std::shared_ptr<server::LoadedScene> two_molecules(int atoms, double gap_m, double damping_per_s, double mass_kg = 0.2,
                                                   bool held = false) {
  const auto body = [&](const std::string& name, double x, double mass) {
    return R"({"name": ")" + name + R"(", "shapes": [{"sphere": {"radius_m": 0.001}}], "gravity": false, "mass_kg": )" +
           std::to_string(mass) + R"(, "linear_damping_per_s": )" + std::to_string(damping_per_s) +
           R"(, "angular_damping_per_s": )" + std::to_string(damping_per_s) + R"(, "placement": {"position_m": [)" +
           std::to_string(x) + R"(, 0, 1], "rotation_xyz_deg": [10, 20, 30]}, "graspable": true})";
  };
  const auto tool = [held](const std::string& name, double x) {
    return R"({"name": ")" + name + (held ? R"(", "holds": ")" + name : "") + R"(", "placement": {"position_m": [)" +
           std::to_string(x) + ", 0, 1]}}";
  };
  auto scene = std::make_shared<server::LoadedScene>(
      *load_parts({.bodies = body("a", 0, mass_kg) + "," + body("b", gap_m, mass_kg / 2),
                   .tools = tool("a", 0) + "," + tool("b", gap_m),
                   .rest = R"("molecular_field": {"newtons_per_kcal_per_mol_angstrom": 0.5, "force_limit_n": 20})"}));
  const double scale = scene->description.molecular_field().metres_per_angstrom();
  for (BodyDescription& described : scene->world.bodies) {
    described.molecule = cluster(atoms);
    described.mass = server::mass_properties_of(described.mass.mass_kg, *described.molecule, scale);
  }
  return scene;
}

TEST(SoftLimit, IsExactBelowTheKneeAndNeverReachesTheLimit) {
  EXPECT_EQ(soft_limit(9.99, 20), 9.99);
  double last = 0;
  for (double x = 0; x < 300; x += 0.5) {
    const double y = soft_limit(x, 20);
    EXPECT_LE(y, 20);
    EXPECT_LE(y, x);
    EXPECT_GE(y, last);
    last = y;
  }
  EXPECT_LE(soft_limit(1e300, 20), 20);
}

TEST(SoftLimit, HasNoEdgeAtTheKnee) {
  const double h = 1e-6;
  const double below = (soft_limit(10, 20) - soft_limit(10 - h, 20)) / h;
  const double above = (soft_limit(10 + h, 20) - soft_limit(10, 20)) / h;
  EXPECT_NEAR(below, 1, 1e-6);
  EXPECT_NEAR(above, 1, 1e-6);
}

TEST(MolecularForces, TwoAtomsAttractWithTheForceOfTheClosedForm) {
  const auto scene = two_molecules(1, 0.05, 0);  // the distance is 5 Å
  MolecularForces forces(scene->world);
  const std::array<Pose, 2> poses{Pose{}, Pose{Vec3(0.05, 0, 0), Quat::Identity()}};
  std::array<Wrench, 2> wrenches{};
  EXPECT_FALSE(forces.add_wrenches(poses, wrenches));
  const double s6 = std::pow(3.4 / 5, 6);
  const double force_kj = 24 * 1.0 / 5 * (2 * s6 * s6 - s6);  // −dV/dr [kJ/mol/Å]
  // Tolerance: the field sums atom pairs in single precision, with a relative error of 1e-5.
  EXPECT_NEAR(wrenches[1].f.x(), 0.5 / 4.184 * force_kj, 1e-5 * std::abs(force_kj));
  EXPECT_NEAR(forces.energy_kj_per_mol(), 4 * (s6 * s6 - s6), 1e-5);
}

TEST(MolecularForces, SumToZeroInForceAndTorqueEvenWhenBounded) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  const auto scene = two_molecules(8, 0.1, 0);
  MolecularForces forces(scene->world);
  int bounded = 0;
  for (int i = 0; i < 300; ++i) {
    const auto draw = [&random](double size) {
      return Vec3(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
    };
    const std::array<Pose, 2> poses{Pose{draw(0.05), quaternion_of(draw(3))}, Pose{draw(0.05), quaternion_of(draw(3))}};
    std::array<Wrench, 2> wrenches{};
    bounded += forces.add_wrenches(poses, wrenches) ? 1 : 0;
    const double size = wrenches[0].f.norm() + 1e-3;
    ASSERT_LE(wrenches[0].f.norm(), 20) << "seed " << kSeed << " draw " << i;
    const Vec3 torque =
        wrenches[0].t + wrenches[1].t + poses[0].p.cross(wrenches[0].f) + poses[1].p.cross(wrenches[1].f);
    ASSERT_LT((wrenches[0].f + wrenches[1].f).norm(), 1e-12 * size) << "seed " << kSeed << " draw " << i;
    ASSERT_LT(torque.norm(), 1e-12 * size) << "seed " << kSeed << " draw " << i;
  }
  EXPECT_GT(bounded, 3) << "the draws must reach the bound, which a share of the energy rarely leaves anything to";
  EXPECT_LT(bounded, 290) << "and the free field";
}

TEST(MolecularForces, CoincidingAtomsPushNoMoreThanTheLimit) {
  const auto scene = two_molecules(1, 0.1, 0);
  MolecularForces forces(scene->world);
  const std::array<Pose, 2> poses{};
  std::array<Wrench, 2> wrenches{};
  forces.add_wrenches(poses, wrenches);
  EXPECT_TRUE(is_finite(wrenches[0]));
  EXPECT_TRUE(std::isfinite(forces.energy_kj_per_mol()));
  EXPECT_LE(wrenches[0].f.norm(), 20);
}

/// Results for molecule B on a closed path in six degrees of freedom: the net work of the force on B, the sum of the
/// magnitudes of its parts, and the range of the energy.
struct Loop {
  double work_j = 0, absolute_j = 0, least_kcal_per_mol = 1e9, most_kcal_per_mol = -1e9;
};
Loop work_on_a_loop(const WorldDescription& world, double distance_m, double way_m, double turn_rad) {
  constexpr int kSteps = 20000;
  MolecularForces forces(world);
  const auto pose = [&](int i) {
    const double t = std::numbers::pi * i / kSteps;
    return Pose{Vec3(distance_m + way_m * std::cos(t), way_m * std::sin(t), 0.7 * way_m * std::sin(2 * t)),
                quaternion_of(turn_rad * Vec3(std::sin(t), std::cos(2 * t), std::sin(t + 1)))};
  };
  const auto wrench = [&](int i) {
    const std::array<Pose, 2> poses{Pose{}, pose(i)};
    std::array<Wrench, 2> wrenches{};
    EXPECT_FALSE(forces.add_wrenches(poses, wrenches))
        << "the force limit acts, so the field is not conservative, at " << forces.energy_kj_per_mol();
    return wrenches[1];
  };
  Loop loop;
  for (int i = 0; i < kSteps; ++i) {
    // The work between two poses is integrated by Simpson's rule.
    const Pose from = pose(2 * i), to = pose(2 * i + 2);
    const Vec3 turned = rotation_vector(to.q * from.q.conjugate());
    const Wrench f0 = wrench(2 * i), f1 = wrench(2 * i + 1), f2 = wrench(2 * i + 2);
    const double work = ((f0.f + 4 * f1.f + f2.f).dot(to.p - from.p) + (f0.t + 4 * f1.t + f2.t).dot(turned)) / 6;
    loop.work_j += work;
    loop.absolute_j += std::abs(work);
    const double energy = forces.energy_kj_per_mol() / docking::kKilojoulesPerKilocalorie;
    loop.least_kcal_per_mol = std::min(loop.least_kcal_per_mol, energy);
    loop.most_kcal_per_mol = std::max(loop.most_kcal_per_mol, energy);
  }
  return loop;
}

TEST(MolecularForces, TheForceDoesNoWorkOnAClosedPath) {
  const auto scene = two_molecules(8, 0.1, 0);
  WorldDescription world = scene->world;
  for (const auto& [cutoff, has_far_grid] : {std::pair(0.0, false), {8.0, false}, {8.0, true}}) {
    for (const auto dielectric : {docking::Dielectric::kNone, docking::Dielectric::kDistance}) {
      world.field_model.cutoff_angstrom = cutoff;
      world.field_model.has_far_grid = has_far_grid;
      world.field_model.dielectric = dielectric;
      world.molecular_minimum_kcal_per_mol = -3.5;
      for (const double zero_kt : {0.0, 1.0}) {
        world.molecular_zero_kt = zero_kt;
        world.molecular_knee_kcal_per_mol = 0.5;
        const Loop loop = work_on_a_loop(world, 0.0765, 0.008, 0.3);
        EXPECT_GT(loop.most_kcal_per_mol, 3) << "beyond the knee";
        EXPECT_LT(loop.least_kcal_per_mol, -1) << "and on the way to the minimum";
        EXPECT_LT(std::abs(loop.work_j), 1e-6 * loop.absolute_j)
            << "cut-off " << cutoff << ", grid " << has_far_grid << ", zero area " << zero_kt;
      }
    }
  }
}

TEST(MolecularForces, AFieldFoundAheadIsOfWhereThingsAre) {
  const auto scene = two_molecules(8, 0.1, 0);
  World without_grid = server::make_server_world(scene), with = server::make_server_world(scene);
  const double start = [&] {
    without_grid.step();
    with.step();
    return without_grid.field_energy_kj_per_mol();
  }();
  EXPECT_NE(start, 0) << "the first step finds it, wherever things are";
  for (int i = 0; i < 20; ++i) {
    with.look_ahead();
    if (i % 5 == 4) {  // the body is moved after the look-ahead
      for (World* world : {&without_grid, &with}) {
        RigidState state = world->body(BodyId{2});
        state.X.p.x() -= 2e-4;
        world->set_body(BodyId{2}, state);
      }
    }
    without_grid.step();
    with.step();
    ASSERT_EQ(with.field_energy_kj_per_mol(), without_grid.field_energy_kj_per_mol()) << i;
    ASSERT_EQ(with.body(BodyId{2}).X.p, without_grid.body(BodyId{2}).X.p) << i;
  }
  EXPECT_NE(with.field_energy_kj_per_mol(), start);
}

TEST(MolecularForces, TheQuickestStepHasTheFieldInItWhereNothingMoves) {
  const auto scene = two_molecules(1000, 1, 0), alone = two_molecules(1, 1, 0);
  const auto quickest_of = [](const server::LoadedScene& of) {
    const auto world = std::make_shared<const WorldDescription>(of.world);
    return World(world, make_followed_bodies(of.world.bodies.size()), nullptr).quickest_step();
  };
  // The field of `scene` has a million atom pairs, that of `alone` a single one. The ratio of their times is therefore
  // far above the noise of timing.
  EXPECT_GT(quickest_of(*scene), 10 * quickest_of(*alone));
}

TEST(MolecularForces, ShareIsTheSlopeOfTheDisplayedForce) {
  WorldDescription world;
  world.molecular_zero_kt = 2;
  world.molecular_minimum_kcal_per_mol = -10;
  world.molecular_knee_kcal_per_mol = 3;
  const double h = 1e-5;
  for (double energy = -12; energy < 1000; energy += energy < 10 ? 0.05 : 10) {
    const double slope =
        (felt_energy_kcal_per_mol(world, energy + h) - felt_energy_kcal_per_mol(world, energy - h)) / (2 * h);
    EXPECT_NEAR(felt_share(world, energy), slope, 1e-6) << energy;
    EXPECT_NEAR(felt_share(world, energy + h), felt_share(world, energy), 4 * h) << energy << ": no edge";
  }
  EXPECT_EQ(felt_share(world, -10 + 2 * 0.592), 0) << "within the zero area";
  EXPECT_EQ(felt_share(world, 0), 1) << "apart";
  EXPECT_EQ(felt_energy_kcal_per_mol(world, 0), 0);
  EXPECT_LT(felt_share(world, 1000), 0.2);
}

TEST(MolecularForces, ShippedHelicesAttractWithTheForceOfTheirScene) {
  TANDEM_LOAD_SCENE(scene, "docking_helices");
  MolecularForces forces(scene->world);
  double strongest_n = 0;
  for (double gap_m = 0.20; gap_m > 0.125; gap_m -= 0.0005) {
    std::array<Pose, 2> poses{scene->world.bodies[0].X_WB, scene->world.bodies[1].X_WB};
    poses[1].p = poses[0].p + Vec3(0, gap_m, 0);
    std::array<Wrench, 2> wrenches{};
    forces.add_wrenches(poses, wrenches);
    strongest_n = std::max(strongest_n, wrenches[0].f.y());
  }
  // The description of the scene states 0.88 N. The tolerance of 0.01 N allows for steps of 0.05 Å and rounded angles.
  EXPECT_NEAR(strongest_n, 0.88, 0.01);
}

TEST(MolecularPair, KeepsItsMomentum) {
  const auto scene = two_molecules(8, 0.10, 0);
  World world(server::make_server_world(scene));
  Vec3 largest = Vec3::Zero();
  for (int i = 0; i < 2000; ++i) {
    world.step();
    const RigidState a = world.body(BodyId{1}), b = world.body(BodyId{2});
    const Vec3 momentum = 0.2 * a.V.v + 0.1 * b.V.v;
    ASSERT_LT(momentum.norm(), 1e-12);
    largest = largest.cwiseMax((0.2 * a.V.v).cwiseAbs());
  }
  EXPECT_GT(largest.norm(), 1e-3) << "the pair must have moved";
}

TEST(MolecularPair, DroppedTogetherSettlesWithoutGainingEnergy) {
  const auto scene = two_molecules(8, 0.12, 3);
  World world(server::make_server_world(scene));
  // Joules in the scene per kJ/mol: force scale 0.5 N per kcal/mol/Å, times length scale 0.01 m/Å.
  const double joules = 0.5 * 0.01 / docking::kKilojoulesPerKilocalorie;
  world.step();
  EXPECT_NEAR(world.field_energy_j(), joules * world.field_energy_kj_per_mol(), 1e-12);
  double start = world.stored_energy_j();
  double last = start;
  for (int block = 0; block < 80; ++block) {
    for (int i = 0; i < 100; ++i) world.step();
    const double energy = world.stored_energy_j();
    // Tolerance: the field energy and the velocity belong to times that are half a step h apart. The energy may differ
    // by |F| v h/2 < 20 N · 0.1 m/s · 0.5 ms.
    EXPECT_LE(energy, last + 1e-3) << "block " << block;
    last = energy;
  }
  EXPECT_LT(last, start - 1e-3) << "they must have found each other";
  EXPECT_LT(world.stored_energy_j() - world.field_energy_j(), 1e-6) << "and rest";
}

/// Returns the speed of two molecules at the end of a run. Two hands bring them together at 0.1 m/s and stop when their
/// couplings pull with `push_n`. The field's wrench is taken from the start of a step (explicit) and does not damp.
/// Only the coupling, which is implicit, provides damping.
double speed_after_pressing(double mass_kg, double damping_per_s, double push_n) {
  const auto scene = two_molecules(8, 0.2, damping_per_s, mass_kg, true);
  World world(server::make_server_world(scene));
  std::array<RigidState, 2> hands;
  for (std::size_t i = 0; i < 2; ++i) {
    world.activate_tool(i);
    hands[i].X = world.tool(i).tool.X;
  }
  double fastest = 0;
  for (int step = 0; step < 4000; ++step) {
    for (std::size_t i = 0; i < 2; ++i) {
      hands[i].V.v.setZero();
      if (world.tool(i).pull_on_tool_W.f.norm() < push_n) hands[i].V.v.x() = i == 0 ? 0.1 : -0.1;
      hands[i].X.p += 0.001 * hands[i].V.v;
      world.set_handle(i, hands[i]);
    }
    world.step();
    if (step < 3500) continue;
    for (const BodyId id : {BodyId{1}, BodyId{2}}) fastest = std::max(fastest, world.body(id).V.v.norm());
  }
  EXPECT_GT(world.tool(0).pull_on_tool_W.f.norm(), 0.9 * push_n) << "they must press on each other";
  return fastest;
}

// The field's wrench is explicit, so it could make a held molecule vibrate. Both molecules must come to rest with a
// step of 1 ms; no smaller step is needed.
TEST(MolecularPair, InTwoHandsComesToRestHoweverItIsPressedLightOrMassiveOrOverDamped) {
  for (const double mass_kg : {0.04, 0.2}) {
    for (const double damping_per_s : {0.0, 2.0, 200.0}) {
      for (const double push_n : {0.5, 2.0, 6.0}) {
        EXPECT_LT(speed_after_pressing(mass_kg, damping_per_s, push_n), 1e-3)
            << mass_kg << " kg, " << damping_per_s << " /s, " << push_n << " N";
      }
    }
  }
}

TEST(MolecularPair, IsTakenAtAnotherAtomWhileTheOtherIsHeldAndTurnsAboutThat) {
  const auto scene = two_molecules(8, 0.2, 2, 0.2, true);
  World world(server::make_server_world(scene));
  const auto hold_at = [&](const Vec3& place_W) {
    RigidState hand{world.tool(0).tool.X, {}};
    hand.X.p = place_W;
    for (int step = 0; step < 3000; ++step) {
      world.set_handle(0, hand);
      world.step();
    }
  };
  world.activate_tool(0);
  world.activate_tool(1);
  const Vec3 centre_W = world.body(BodyId{1}).X.p;
  world.release(0);
  const Vec3 corner = scene->world.metres_per_angstrom * scene->world.bodies[0].molecule->positions_angstrom[7];
  const Vec3 corner_W = world.body(BodyId{1}).X * corner;
  hold_at(centre_W + 3 * (corner_W - centre_W));
  EXPECT_EQ(world.grab(0, BodyId{1}), GrabResult::kOutOfReach) << "not from afar";
  hold_at(corner_W);
  ASSERT_EQ(world.grab(0, BodyId{}), GrabResult::kGrabbed);
  const Vec3 tool_W = world.tool(0).tool.X.p;
  const Vec3 place_B = world.body(BodyId{1}).X.inverse() * tool_W;
  EXPECT_LT((place_B - corner).norm(), 0.01) << "it floats, and has gone a little";
  const Quat before = world.body(BodyId{1}).X.q;
  hold_at(tool_W + Vec3(0, 0, 0.02));
  EXPECT_LT((world.body(BodyId{1}).X * place_B - (tool_W + Vec3(0, 0, 0.02))).norm(), 1e-4) << "it follows the hand";
  EXPECT_LT(before.angularDistance(world.body(BodyId{1}).X.q), 0.2) << "the hand must also keep its orientation";
}

}  // namespace
}  // namespace tandem::physics
