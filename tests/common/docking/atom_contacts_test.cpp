// Compares contacts and hydrogen bonds with a search over all pairs of atoms, and with constructed geometries.
#include "common/docking/atom_contacts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <random>

#include "server/assets/structures/loader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"

namespace tandem::docking {
namespace {

Molecule atoms(const std::vector<std::pair<double, Vec3>>& masses_and_places) {
  Molecule molecule;
  for (const auto& [mass_u, place] : masses_and_places) {
    molecule.positions_angstrom.push_back(place);
    molecule.mass_u.push_back(mass_u);
  }
  return molecule;
}

constexpr double kH = 1.008, kC = 12.011, kN = 14.007, kO = 15.999;

/// Returns the hydrogen bonds between an N−H group along x and an oxygen at `distance` [Å] from the hydrogen.
/// `angle_deg` is the angle N−H···O at the hydrogen.
AtomPairs bonds_of(double distance, double angle_deg) {
  const Molecule donor = atoms({{kN, {0, 0, 0}}, {kH, {1.01, 0, 0}}});
  const Molecule acceptor = atoms({{kC, {1.2, 0, 0}}, {kO, {0, 0, 0}}, {kH, {2.2, 0.4, 0}}});
  const double turn = (180 - angle_deg) * std::numbers::pi / 180;
  const Vec3 oxygen = Vec3(1.01, 0, 0) + distance * Vec3(std::cos(turn), std::sin(turn), 0);
  return hydrogen_bonds(donor, acceptor, {oxygen, Quat::Identity()});
}

TEST(AtomContacts, AHydrogenBondIsOneByDistanceAndAngle) {
  EXPECT_EQ(bonds_of(2.0, 170), (AtomPairs{{0, 1}}));
  EXPECT_EQ(bonds_of(2.49, 121), (AtomPairs{{0, 1}}));
  EXPECT_TRUE(bonds_of(2.51, 170).empty());
  EXPECT_TRUE(bonds_of(2.0, 119).empty());
}

TEST(AtomContacts, WithoutHydrogensHeavyAtomsCount) {
  const Molecule nitrogen = atoms({{kN, {0, 0, 0}}});
  const Molecule oxygen = atoms({{kO, {0, 0, 0}}});
  EXPECT_EQ(hydrogen_bonds(nitrogen, oxygen, {{3.4, 0, 0}, Quat::Identity()}).size(), 1U);
  EXPECT_TRUE(hydrogen_bonds(nitrogen, oxygen, {{3.6, 0, 0}, Quat::Identity()}).empty());
  EXPECT_TRUE(hydrogen_bonds(nitrogen, atoms({{kC, {0, 0, 0}}}), {{3.4, 0, 0}, Quat::Identity()}).empty());
}

TEST(AtomContacts, AreTheSameFromEitherSideAndAsOfEveryPair) {
  std::mt19937 random(5);
  Molecule a = test::random_molecule(300, random), b = test::random_molecule(200, random);
  a.mass_u.assign(a.size(), kC);
  b.mass_u.assign(b.size(), kC);
  for (std::size_t i = 0; i < b.size(); i += 3) b.mass_u[i] = kH;
  const Pose X_AB{{9, -4, 3}, test::random_rotation(random)};
  AtomPairs expected;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const double distance = (a.positions_angstrom[i] - X_AB * b.positions_angstrom[j]).norm();
      if (b.mass_u[j] > 2 && distance <= kContactAngstrom) expected.emplace_back(i, j);
    }
  }
  ASSERT_GT(expected.size(), 10U);
  EXPECT_EQ(atom_contacts(a, b, X_AB), expected);
  AtomPairs from_b = atom_contacts(b, a, X_AB.inverse());
  for (auto& [i, j] : from_b) std::swap(i, j);
  std::ranges::sort(from_b);
  EXPECT_EQ(from_b, expected);
}

TEST(AtomContacts, AtomsNearerThanSevenTenthsOfTheirRadiiAreNamedByWhatTheyAre) {
  const Molecule carbon = atoms({{kC, {0, 0, 0}}}), oxygen = atoms({{kO, {0, 0, 0}}});
  const Molecule methane = atoms({{kC, {0, 0, 0}}, {kH, {1.09, 0, 0}}}),
                 ammonia = atoms({{kN, {0, 0, 0}}, {kH, {1.01, 0, 0}}});
  const auto close = [](const Molecule& a, const Molecule& b, double way) {
    return close_atoms(a, b, {{way, 0, 0}, Quat::Identity()});
  };
  // Clash limit for two carbon atoms: 0.7 · 3.40 Å = 2.38 Å.
  EXPECT_TRUE(close(carbon, carbon, 2.39).empty());
  ASSERT_EQ(close(carbon, carbon, 2.37).size(), 1U);
  EXPECT_EQ(close(carbon, carbon, 2.37)[0].closeness, Closeness::kClash);
  EXPECT_NEAR(close(carbon, carbon, 2.37)[0].share, 2.37 / 3.4, 1e-12);
  EXPECT_EQ(close(carbon, carbon, 1.5)[0].closeness, Closeness::kBond);
  // The hydrogen is 1.7 Å from the oxygen, 0.65 of the sum of their radii. At this distance, a hydrogen that is bonded
  // to nitrogen forms a hydrogen bond. One that is bonded to carbon is a clash.
  ASSERT_EQ(close(ammonia, oxygen, 2.71).size(), 1U);
  EXPECT_EQ(close(ammonia, oxygen, 2.71)[0].closeness, Closeness::kHydrogenBond);
  EXPECT_EQ(close(ammonia, oxygen, 1.01 + 1.25)[0].closeness, Closeness::kClash);
  ASSERT_EQ(close(methane, oxygen, 2.79).size(), 1U);
  EXPECT_EQ(close(methane, oxygen, 2.79)[0].closeness, Closeness::kClash);
  EXPECT_TRUE(close(oxygen, methane, 2.3).empty()) << "the hydrogen points away";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(close(carbon, carbon, nan).empty());
}

TEST(AtomContacts, AnInvalidPoseHasNone) {
  const Molecule carbon = atoms({{kC, {0, 0, 0}}});
  EXPECT_EQ(atom_contacts(carbon, carbon, Pose{}).size(), 1U);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(atom_contacts(carbon, carbon, {{nan, 0, 0}, Quat::Identity()}).empty());
  EXPECT_TRUE(hydrogen_bonds(carbon, carbon, {{nan, 0, 0}, Quat::Identity()}).empty());
}

TEST(AtomContacts, RmsdOfAShiftIsTheShift) {
  std::mt19937 random(6);
  const Molecule molecule = test::random_molecule(50, random);
  const Quat turn = test::random_rotation(random);
  EXPECT_NEAR(rmsd_angstrom(molecule, {{0, 0, 0}, turn}, {{0, 3, 4}, turn}), 5, 1e-12);
  EXPECT_NEAR(rmsd_angstrom(molecule, {{1, 2, 3}, turn}, {{1, 2, 3}, turn}), 0, 1e-12);
}

/// An interface of a real protein. It has hydrogen bonds in salt bridges and between the backbones of its two chains.
TEST(AtomContacts, ARealInterfaceHasBonds) {
  const std::filesystem::path file = "/usr/share/pymol/data/tut/1hpv.pdb";
  TANDEM_NEEDS_FILES(file, test::kOplsDirectory);
  const auto chain = [&file](const char* name) {
    return server::load_molecule(file, {{name}}, test::kOplsDirectory, server::Hydrogens::kBuild);
  };
  const Molecule a = chain("A"), b = chain("B");
  // Expected bonds: those of the four-stranded sheet formed by the ends of both chains.
  const AtomPairs bonds = hydrogen_bonds(a, b, Pose{});
  EXPECT_GT(bonds.size(), 8U);
  EXPECT_LT(bonds.size(), 40U);
  for (const auto& [i, j] : bonds) {
    EXPECT_LT((a.positions_angstrom[i] - b.positions_angstrom[j]).norm(), 3.6);
  }
  EXPECT_GT(atom_contacts(a, b, Pose{}).size(), 5 * bonds.size());
}

}  // namespace
}  // namespace tandem::docking
