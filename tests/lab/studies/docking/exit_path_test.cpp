// Tests exit paths of constructed pairs of molecules, in which the positions of all walls are known.
#include "lab/studies/docking/exit_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/docking/exact_field.hpp"
#include "lab/studies/docking/docking_trial.hpp"
#include "tests/support/molecules.hpp"

namespace tandem::lab {
namespace {

void add_atom(docking::Molecule& molecule, const Vec3& position) {
  molecule.positions_angstrom.push_back(position);
  molecule.sigma_angstrom.push_back(3.4);
  molecule.epsilon_kj_per_mol.push_back(0.4);
  molecule.charge_e.push_back(0);
  molecule.mass_u.push_back(12);
}

/// Returns about 110 atoms spread over a sphere of 6 Å around the origin, some 2.2 Å apart. There are no atoms above z
/// = `open_above`.
docking::Molecule shell(double open_above) {
  docking::Molecule made;
  constexpr int kAtoms = 110;
  for (int i = 0; i < kAtoms; ++i) {
    const double z = 1 - (2 * i + 1.0) / kAtoms, turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vec3 position = 6 * Vec3(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
    if (position.z() <= open_above) add_atom(made, position);
  }
  return made;
}

/// Returns a molecule of two atoms, for which the search must also try rotations.
docking::Molecule dumb_bell() {
  docking::Molecule made;
  add_atom(made, Vec3(0, 0, 0.7));
  add_atom(made, Vec3(0, 0, -0.7));
  return made;
}

double energy_kcal_per_mol(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB) {
  return docking::exact_field(a, b, X_AB).energy_kj_per_mol() / docking::kKilojoulesPerKilocalorie;
}

TEST(ExitPath, LeadsOutOfABowlThroughBoundedEnergiesInSmallSteps) {
  const docking::Molecule bowl = shell(2), ligand = dumb_bell();
  for (const std::uint64_t seed : {1, 2, 3}) {
    const std::vector<Pose> way = exit_path(bowl, ligand, {}, Pose{}, seed);
    ASSERT_GE(way_out_angstrom(way), kExitDistance_angstrom) << "seed " << seed;
    EXPECT_EQ(way.front().p, Vec3::Zero());
    for (std::size_t i = 0; i < way.size(); ++i) {
      // Margin of 0.01 kcal/mol, because the kernel of the search computes in single precision.
      ASSERT_LE(energy_kcal_per_mol(bowl, ligand, way[i]), kExitBound_kcal_per_mol + 0.01) << seed << ", pose " << i;
      if (i == 0) continue;
      EXPECT_LE((way[i].p - way[i - 1].p).norm(), kExitStep_angstrom + 0.4 + 1e-9);
      const Pose between{(way[i].p + way[i - 1].p) / 2, way[i].q.slerp(0.5, way[i - 1].q)};
      EXPECT_LE(energy_kcal_per_mol(bowl, ligand, between), kExitBound_kcal_per_mol + 0.01) << seed << ", before " << i;
    }
    EXPECT_GT(way.back().p.z(), 2) << "by the opening";
    EXPECT_GE(energy_kcal_per_mol(bowl, ligand, way.back()), -kHardlyHeld_kcal_per_mol - 0.01);
  }
}

TEST(ExitPath, IsAnotherWithAnotherSeedAndTheSameWithTheSame) {
  const docking::Molecule bowl = shell(2), ligand = dumb_bell();
  const std::vector<Pose> one = exit_path(bowl, ligand, {}, Pose{}, 1), again = exit_path(bowl, ligand, {}, Pose{}, 1);
  ASSERT_EQ(one.size(), again.size());
  EXPECT_EQ(one.back().p, again.back().p);
  EXPECT_NE(one.back().p, exit_path(bowl, ligand, {}, Pose{}, 2).back().p);
}

TEST(ExitPath, OfACageEndsInside) {
  const docking::Molecule cage = shell(6), ligand = dumb_bell();
  const std::vector<Pose> way = exit_path(cage, ligand, {}, Pose{}, 1, 4000);
  EXPECT_LT(way_out_angstrom(way), 4) << "2 Å and less from its wall";
}

TEST(PartOf, KeepsTheForceFieldParametersOfItsAtoms) {
  docking::Molecule bowl = shell(2);
  bowl.mixes_arithmetically = true;
  bowl.sigma_angstrom[3] = 3.3;
  bowl.epsilon_kj_per_mol[3] = 0.5;
  bowl.charge_e[3] = -0.2;
  bowl.mass_u[3] = 14;
  const docking::Molecule part = part_of(bowl, [](std::size_t i) { return i == 1 || i == 3; });
  ASSERT_EQ(part.size(), 2U);
  EXPECT_TRUE(part.mixes_arithmetically);
  EXPECT_EQ(part.positions_angstrom[1], bowl.positions_angstrom[3]);
  EXPECT_EQ(part.sigma_angstrom[1], 3.3);
  EXPECT_EQ(part.epsilon_kj_per_mol[1], 0.5);
  EXPECT_EQ(part.charge_e[1], -0.2);
  EXPECT_EQ(part.mass_u[1], 14);
}

}  // namespace
}  // namespace tandem::lab
