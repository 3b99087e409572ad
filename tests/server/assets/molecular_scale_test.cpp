// Tests the force scale that is found by probing the field: for two atoms against closed forms, for a real pair of
// molecules, and for a scene made from two files. A wrong scale makes docking forces imperceptible or saturated.
#include "server/assets/molecular_scale.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "common/physics/molecular_forces.hpp"
#include "server/assets/docking_scene.hpp"
#include "server/assets/scene_checks.hpp"
#include "server/assets/scene_file.hpp"
#include "server/assets/structures/loader.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

using docking::kKilojoulesPerKilocalorie;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kSigma = 3.4, kEpsilon = 1.0;

docking::Molecule atom(double charge_e = 0) {
  docking::Molecule molecule;
  molecule.positions_angstrom = {Vec3::Zero()};
  molecule.sigma_angstrom = {kSigma};
  molecule.epsilon_kj_per_mol = {kEpsilon};
  molecule.charge_e = {charge_e};
  molecule.mass_u = {39.95};
  return molecule;
}

wire::MolecularField open_field() {
  wire::MolecularField field;
  field.set_metres_per_angstrom(0.01);
  field.set_force_limit_n(20);
  return field;
}

TEST(MolecularScale, OfTwoAtomsIsThatOfTheClosedForm) {
  const docking::Molecule a = atom(), b = atom();
  wire::MolecularField field = open_field();
  const std::array<const docking::Molecule*, 2> molecules{&a, &b};
  const std::array<Vec3, 2> centres{Vec3::Zero(), Vec3(4, 0, 0)};
  const auto notes = complete_molecular_scale(field, molecules, centres, {});
  // Expected scale: it maps the strongest attraction to 1 N. The Lennard-Jones attraction of two atoms is strongest at
  // r = (26/7)^(1/6) σ.
  const double s6 = 7.0 / 26;
  const double pull = 24 * kEpsilon / kSigma * std::pow(s6, 1.0 / 6) * (s6 - 2 * s6 * s6) / kKilojoulesPerKilocalorie;
  EXPECT_NEAR(field.newtons_per_kcal_per_mol_angstrom(), 1 / pull, 0.01 / pull);
  // The knee is the energy at which the repulsive force |V'| reaches 5 N in the hand, a quarter of the force limit. The
  // result is exact up to the probe's step of 0.1 Å.
  const auto energy = [](double r) {
    const double x = std::pow(kSigma / r, 6);
    return 4 * kEpsilon * (x * x - x) / kKilojoulesPerKilocalorie;
  };
  const auto push = [](double r) {
    const double x = std::pow(kSigma / r, 6);
    return 24 * kEpsilon / r * (2 * x * x - x) / kKilojoulesPerKilocalorie;
  };
  double r = 1.12 * kSigma;
  while (push(r) < 5 * pull) r -= 1e-4;
  EXPECT_GE(field.knee_kcal_per_mol(), energy(r) - 1e-3);
  EXPECT_LE(field.knee_kcal_per_mol(), energy(r - 0.1) + 1e-3);
  EXPECT_EQ(field.minimum_kcal_per_mol(), 0) << "the minimum must not be computed without a request";
  EXPECT_THAT(notes, ElementsAre(HasSubstr("pairs of atoms act on each other"), HasSubstr("1 N in the hand is")));
}

/// Returns a block beside the origin, with a pocket in the middle of one face. Only the inner surface of the pocket
/// attracts strongly. Fails if the probe never enters the pocket: it would find too little attraction.
docking::Molecule block_with_pocket(const Vec3& pocket) {
  docking::Molecule block;
  for (int layer = 0; layer < 3; ++layer) {
    for (int x = -3; x <= 3; ++x) {
      for (int y = -3; y <= 3; ++y) {
        const int from_middle = std::abs(x) + std::abs(y);
        if (layer == 0 && from_middle < 2) continue;
        const bool is_lining = layer == 0 ? std::abs(x) == 1 && std::abs(y) == 1 : layer == 1 && from_middle < 2;
        block.positions_angstrom.push_back(pocket + 3 * Vec3(x, y, -layer));
        block.sigma_angstrom.push_back(kSigma);
        block.epsilon_kj_per_mol.push_back(is_lining ? kEpsilon : 0.001);
        block.charge_e.push_back(0);
        block.mass_u.push_back(39.95);
      }
    }
  }
  return block;
}

TEST(MolecularScale, FindsThePocketThatNoLineThroughTheCentreReaches) {
  const Vec3 pocket(40, 0, 0);
  const docking::Molecule a = block_with_pocket(pocket), b = atom();
  double pull = 0;  // largest attraction on a straight path out of the pocket
  for (double out = 0; out < 8; out += 0.05) {
    const docking::FieldResult here = docking::exact_field(a, b, {pocket + Vec3(0, 0, out), Quat::Identity()});
    pull = std::max(pull, -here.force_on_b.z() / kKilojoulesPerKilocalorie);
  }
  const std::array<const docking::Molecule*, 2> molecules{&a, &b};
  const auto strongest_n = [&](const Vec3& native) {
    wire::MolecularField field = open_field();
    const std::array<Vec3, 2> centres{Vec3::Zero(), native};
    complete_molecular_scale(field, molecules, centres, {});
    return field.newtons_per_kcal_per_mol_angstrom() * pull;
  };
  EXPECT_NEAR(strongest_n(pocket), 1, 0.2);
  EXPECT_NEAR(strongest_n(Vec3(0, 0, 90)) / pull, 0.03, 1e-9) << "a pocket cannot be found from outside";
}

TEST(MolecularScale, KeepsTheScaleOfTheAuthor) {
  const docking::Molecule a = atom(), b = atom();
  wire::MolecularField field = open_field();
  field.set_newtons_per_kcal_per_mol_angstrom(0.25);
  field.set_knee_kcal_per_mol(2);
  field.set_minimum_kcal_per_mol(-3);
  field.set_zero_area_kt(1);
  const std::array<const docking::Molecule*, 2> molecules{&a, &b};
  const std::array<Vec3, 2> centres{Vec3::Zero(), Vec3(4, 0, 0)};
  complete_molecular_scale(field, molecules, centres, {});
  EXPECT_EQ(field.newtons_per_kcal_per_mol_angstrom(), 0.25);
  EXPECT_EQ(field.knee_kcal_per_mol(), 2);
  EXPECT_EQ(field.minimum_kcal_per_mol(), -3);
}

TEST(MolecularScale, LikeChargesThatOnlyRepelHaveOneToo) {
  const docking::Molecule a = atom(4), b = atom(4);
  wire::MolecularField field = open_field();
  docking::FieldModel model;
  model.dielectric = docking::Dielectric::kDistance;
  const std::array<const docking::Molecule*, 2> molecules{&a, &b};
  const std::array<Vec3, 2> centres{Vec3::Zero(), Vec3::Zero()};
  complete_molecular_scale(field, molecules, centres, model);
  EXPECT_NEAR(field.newtons_per_kcal_per_mol_angstrom(), 0.03, 1e-9) << "molecules without attraction get the default";
  // Expected knee: the energy at a repulsion of 5 N, which is 167 kcal/mol/Å at the scale of 0.03 N per kcal/mol/Å. The
  // electrostatic repulsion does not reach this value. The energy must therefore include a Lennard-Jones repulsion.
  const double charges = 16 * docking::kCoulombKjAngstromPerMol / (4 * kSigma * kSigma) / kKilojoulesPerKilocalorie;
  EXPECT_GT(field.knee_kcal_per_mol(), charges);
  EXPECT_LT(field.knee_kcal_per_mol(), 3 * charges);
}

TEST(MolecularScale, AZeroAreaThatWouldTakeAllAttractionIsLeftOut) {
  const docking::Molecule a = atom(), b = atom();
  const std::array<const docking::Molecule*, 2> molecules{&a, &b};
  // The centres of both atoms coincide, so there is no direction from one to the other. The probe must approach from
  // another direction to find the energy well.
  const std::array<Vec3, 2> centres{Vec3::Zero(), Vec3::Zero()};
  wire::MolecularField field = open_field();
  field.set_zero_area_kt(1);
  const auto notes = complete_molecular_scale(field, molecules, centres, {});
  EXPECT_EQ(field.zero_area_kt(), 0);
  EXPECT_NEAR(field.minimum_kcal_per_mol(), -kEpsilon / kKilojoulesPerKilocalorie, 1e-3) << "found from a side";
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("no zero area")));
}

TEST(MolecularScale, AMinimumThatTakesTooLongIsToBeGiven) {
  docking::Molecule large = atom();
  for (int i = 1; i < 1100; ++i) {
    const int column = i % 10, row = i / 10 % 10, layer = i / 100;
    large.positions_angstrom.emplace_back(4.0 * column, 4.0 * row, 4.0 * layer);
    large.sigma_angstrom.push_back(kSigma);
    large.epsilon_kj_per_mol.push_back(kEpsilon);
    large.charge_e.push_back(0);
    large.mass_u.push_back(39.95);
  }
  const std::array<const docking::Molecule*, 2> molecules{&large, &large};
  const std::array<Vec3, 2> centres{Vec3::Zero(), Vec3(60, 0, 0)};
  docking::FieldModel model;
  model.cutoff_angstrom = 8;
  wire::MolecularField field = open_field();
  field.set_zero_area_kt(1);
  EXPECT_THROW(complete_molecular_scale(field, molecules, centres, model), std::invalid_argument);
  field.set_minimum_kcal_per_mol(-100);
  EXPECT_NO_THROW(complete_molecular_scale(field, molecules, centres, model));
}

TEST(MolecularScale, ContactIsWhereTheEnergyIs5) {
  const docking::Molecule a = atom(), b = atom();
  const double distance = contact_distance_angstrom(a, b, {}, Vec3::UnitY());
  const docking::FieldResult inside = docking::exact_field(a, b, {Vec3(0, distance - 0.1, 0), Quat::Identity()});
  const docking::FieldResult here = docking::exact_field(a, b, {Vec3(0, distance, 0), Quat::Identity()});
  EXPECT_LT(here.energy_kj_per_mol(), 5 * kKilojoulesPerKilocalorie);
  EXPECT_GT(inside.energy_kj_per_mol(), 5 * kKilojoulesPerKilocalorie);
}

TEST(MinimumNear, OfTwoAtomsIsTheirEpsilon) {
  const auto [X, energy] = minimum_near(atom(), atom(), {}, {Vec3(3, 1, 2), Quat::Identity()});
  EXPECT_NEAR(energy, -kEpsilon / kKilojoulesPerKilocalorie, 1e-6);
  EXPECT_NEAR(X.p.norm(), std::pow(2.0, 1.0 / 6) * kSigma, 1e-3);
}

TEST(MinimumNear, OfARealPairHasNoForceLeft) {
  const std::filesystem::path file = "/usr/share/pymol/test/dat/3al1.pdb";
  TANDEM_NEEDS_FILES(file, kOplsDirectory);
  const docking::Molecule a = load_molecule(file, {{"A"}}, kOplsDirectory);
  const docking::Molecule b = load_molecule(file, {{"B"}}, kOplsDirectory);
  for (const auto dielectric : {docking::Dielectric::kNone, docking::Dielectric::kDistance}) {
    docking::FieldModel model;
    model.dielectric = dielectric;
    const docking::FieldResult start = docking::exact_field(a, b, Pose{}, model);
    const auto [X, energy] = minimum_near(a, b, model, Pose{});
    const docking::FieldResult end = docking::exact_field(a, b, X, model);
    EXPECT_LT(end.energy_kj_per_mol(), start.energy_kj_per_mol());
    EXPECT_NEAR(end.energy_kj_per_mol() / kKilojoulesPerKilocalorie, energy, 1e-9);
    EXPECT_LT(end.force_on_b.norm(), 1e-2 * start.force_on_b.norm());
    EXPECT_LT(end.torque_on_b.norm(), 1e-2 * start.torque_on_b.norm());
  }
}

const char* const kHelices = "/usr/share/pymol/test/dat/3al1.pdb";

wire::MoleculeSource helix(const std::string& chain) {
  wire::MoleculeSource source;
  source.set_file(kHelices);
  source.add_chains(chain);
  source.set_hydrogens("given");
  return source;
}

TEST(DockingScene, OfTwoFilesIsApartAsTheFilesHaveThemAndPullsWithOneNewton) {
  TANDEM_NEEDS_FILES(kHelices, kOplsDirectory);
  const wire::Scene requested = docking_scene(helix("A"), helix("B"), {});
  const auto scene = load_scene_text(scene_text(requested), "two files", ".");
  const wire::MolecularField& field = scene->description.molecular_field();
  EXPECT_EQ(field.dielectric(), "4r");
  EXPECT_EQ(field.cutoff_angstrom(), 0);
  EXPECT_EQ(field.zero_area_kt(), 1);
  const physics::BodyDescription& a = scene->world.bodies.at(0);
  const physics::BodyDescription& b = scene->world.bodies.at(1);
  EXPECT_LT(a.X_WB.q.angularDistance(b.X_WB.q), 1e-12) << "turned alike";
  double nearest_angstrom = 1e9;
  for (const Vec3& of_a : a.molecule->positions_angstrom) {
    for (const Vec3& of_b : b.molecule->positions_angstrom) {
      const Vec3 way = a.X_WB * (0.01 * of_a) - b.X_WB * (0.01 * of_b);
      nearest_angstrom = std::min(nearest_angstrom, 100 * way.norm());
    }
  }
  EXPECT_GT(nearest_angstrom, 5) << "8 angstrom along the line of centres, askew to their surfaces";
  EXPECT_LT(nearest_angstrom, 12);
  // One of the descents to the minimum starts at the pose in the files, so the minimum must be below the energy of that
  // pose.
  const docking::Molecule native_a = load_molecule(kHelices, {{"A"}}, kOplsDirectory);
  const docking::Molecule native_b = load_molecule(kHelices, {{"B"}}, kOplsDirectory);
  const docking::FieldResult native = docking::exact_field(native_a, native_b, Pose{}, scene->world.field_model);
  EXPECT_LT(field.minimum_kcal_per_mol(), native.energy_kj_per_mol() / kKilojoulesPerKilocalorie);
  EXPECT_LT(field.minimum_kcal_per_mol(), -3) << "several kT: the zero area leaves most to be felt";
  EXPECT_GT(field.knee_kcal_per_mol(), field.minimum_kcal_per_mol());

  // The scale was found by probing several lines, including the line of centres, and maps the strongest attraction to 1
  // N. Along the line of centres, the attraction must therefore not exceed 1 N, except by rounding.
  const physics::WorldDescription& world = scene->world;
  docking::MolecularField pull(*a.molecule, *b.molecule, world.field_model);
  const Pose X_AB = a.X_WB.inverse() * b.X_WB;
  double strongest_n = 0;
  for (double share = 1, pull_n = 0; pull_n > -1 && share > 0; share -= 0.002) {
    const docking::FieldResult result = pull.evaluate({100 * share * X_AB.p, X_AB.q});
    pull_n = -result.force_on_b.dot(X_AB.p.normalized()) / kKilojoulesPerKilocalorie *
             world.newtons_per_kcal_per_mol_angstrom;
    strongest_n = std::max(strongest_n, pull_n);
  }
  EXPECT_GT(strongest_n, 0.3);
  EXPECT_LT(strongest_n, 1.02);
}

TEST(DockingScene, OfFilesWithoutHydrogensNeedsNoParameterFiles) {
  const test::PdbFile file(test::residue_text("ALA", "N CA C O CB", 1) + test::residue_text("GLY", "N CA C O", 1, 'B'));
  wire::MoleculeSource receptor, ligand;
  receptor.set_file(file.path().string());
  receptor.add_chains("A");
  ligand.set_file(file.path().string());
  ligand.add_chains("B");
  wire::MolecularField field;
  field.set_force_field_directory(kBuiltInForceField);
  const auto scene = load_scene_text(scene_text(docking_scene(receptor, ligand, field)), "two files", ".");
  EXPECT_EQ(scene->world.bodies.at(0).molecule->size(), 5U);
  EXPECT_EQ(scene->world.bodies.at(0).molecule->force_field, "built-in");
  EXPECT_EQ(scene->description.bodies(0).shapes(0).molecule().hydrogens(), "given");
  EXPECT_THAT(scene->notes_for_users, ::testing::Contains(HasSubstr("built-in parameters by element, no charges")));
}

TEST(DockingScene, ALargePairFitsTheHand) {
  const std::filesystem::path file = "/usr/share/pymol/data/demo/1tii.pdb";
  TANDEM_NEEDS_FILES(file, kOplsDirectory);
  const auto chain = [&](const std::string& name) {
    wire::MoleculeSource source;
    source.set_file(file.string());
    source.add_chains(name);
    source.set_hydrogens("given");
    return source;
  };
  const wire::Scene scene = docking_scene(chain("D"), chain("E"), {});
  const double scale_m = scene.molecular_field().metres_per_angstrom();
  double larger_m = 0;
  for (const char* name : {"D", "E"}) {
    docking::Molecule molecule = load_molecule(file, {{name}}, kOplsDirectory);
    molecule.centre();
    larger_m = std::max(larger_m, scale_m * molecule.gyration_radius_angstrom());
  }
  EXPECT_NEAR(larger_m, 0.08, 2e-4) << "scale rounded to 0.01 mm";
  EXPECT_LT(scale_m, 0.008);
  EXPECT_NEAR(scene.coupling().stiffness_n_per_m() * scale_m, 5, 0.05) << "newtons for each angstrom, as of small ones";
}

TEST(DockingScene, AGridAddsTheForcesBeyondTheCutOff) {
  TANDEM_NEEDS_FILES(kHelices, kOplsDirectory);
  wire::MolecularField field;
  const auto load = [&] {
    return load_scene_text(scene_text(docking_scene(helix("A"), helix("B"), field)), "two files", ".");
  };
  field.set_zero_area_kt(0);
  const auto all = load();
  EXPECT_THAT(all->notes_for_users, ::testing::Contains("all 48400 pairs of atoms act on each other"));
  field.set_cutoff_angstrom(8);
  const auto cut = load();
  field.clear_cutoff_angstrom();
  field.set_far_grid(true);
  const auto grid = load();
  EXPECT_EQ(grid->description.molecular_field().cutoff_angstrom(), 8);
  EXPECT_THAT(grid->notes_for_users,
              ::testing::Contains("atoms within 8 angstrom act on each other, and those beyond by a grid"));
  const auto force_kcal_per_mol = [](const LoadedScene& scene, double apart_m) {
    physics::MolecularForces forces(scene.world);
    std::array<Wrench, 2> wrenches{};
    forces.add_wrenches(std::array{Pose{}, Pose{Vec3(0, apart_m, 0), Quat::Identity()}}, wrenches);
    return Vec3(wrenches[1].f / scene.world.newtons_per_kcal_per_mol_angstrom);
  };
  for (const double apart_m : {0.15, 0.25}) {
    const Vec3 wanted = force_kcal_per_mol(*all, apart_m);
    const Vec3 missed = wanted - force_kcal_per_mol(*grid, apart_m);
    EXPECT_LT(missed.norm(), 0.02 * wanted.norm()) << apart_m;
    EXPECT_GT((wanted - force_kcal_per_mol(*cut, apart_m)).norm(), 0.1 * wanted.norm()) << apart_m;
  }
  // The scale found with a grid must agree within 5 % with the scale found by summing all pairs.
  EXPECT_NEAR(grid->world.newtons_per_kcal_per_mol_angstrom, all->world.newtons_per_kcal_per_mol_angstrom,
              0.05 * all->world.newtons_per_kcal_per_mol_angstrom);
}

TEST(DockingScene, TheNumberOfPairsDeterminesTheMethod) {
  const std::string file = "/usr/share/pymol/data/demo/1tii.pdb";
  TANDEM_NEEDS_FILES(file, kOplsDirectory);
  const auto field_of = [&](const std::string& hydrogens, const wire::MolecularField& requested) {
    return docking_scene(molecule_source(file + ":D", hydrogens), molecule_source(file + ":E", hydrogens), requested)
        .molecular_field();
  };
  const wire::MolecularField few = field_of("united", {}), many = field_of("build", {});
  EXPECT_EQ(few.cutoff_angstrom(), 0);
  EXPECT_FALSE(few.far_grid());
  EXPECT_EQ(many.cutoff_angstrom(), 8);
  EXPECT_TRUE(many.far_grid());
  wire::MolecularField requested;
  requested.set_cutoff_angstrom(8);
  EXPECT_FALSE(field_of("build", requested).far_grid()) << "an explicit cut-off must not add a grid";
}

TEST(DockingScene, AWrongDielectricIsSaid) {
  TANDEM_NEEDS_FILES(kHelices, kOplsDirectory);
  wire::MolecularField field;
  field.set_dielectric("four");
  EXPECT_THROW(docking_scene(helix("A"), helix("B"), field), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::server
