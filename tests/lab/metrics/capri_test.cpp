// Tests CAPRI measures on constructed molecules, for which the values have closed forms.
#include "lab/metrics/capri.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "tests/support/molecules.hpp"

namespace tandem::lab {
namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

void add_atom(docking::Molecule& molecule, const std::string& residue, const std::string& name, const Vec3& position,
              const std::string& element = "C") {
  molecule.positions_angstrom.push_back(position);
  molecule.atom_names.push_back(name);
  molecule.elements.push_back(element);
  molecule.residue_names.emplace_back("UNK");
  molecule.residue_ids.push_back(residue);
  molecule.chains.emplace_back("A");
  molecule.segments.push_back(0);
}

/// Returns one residue of four carbons, none of which has the name of a backbone atom. They are the corners of a square
/// with a side of 2 Å, perpendicular to x.
docking::Molecule square() {
  docking::Molecule made;
  for (const double y : {-1.0, 1.0}) {
    for (const double z : {-1.0, 1.0}) add_atom(made, "1", "C" + std::to_string(made.size()), {0, y, z});
  }
  return made;
}

/// Returns `count` residues of one carbon each, at a spacing of `gap` along y.
docking::Molecule row_of_residues(int count, double gap) {
  docking::Molecule made;
  for (int i = 0; i < count; ++i) add_atom(made, std::to_string(i + 1), "C1", {0, i * gap, 0});
  return made;
}

Pose at_x(double x) {
  return {{x, 0, 0}, Quat::Identity()};
}

Pose turned(const Vec3& axis, double angle, const Vec3& p) {
  return {p, Quat(Eigen::AngleAxisd(angle, axis))};
}

TEST(Capri, LigandRmsdOfATranslationIsItsLengthAndHydrogensDoNotCount) {
  docking::Molecule ligand = square();
  EXPECT_NEAR(ligand_rmsd_angstrom(ligand, at_x(4), {{4, 2, 1.5}, Quat::Identity()}), 2.5, 1e-12);
  EXPECT_EQ(ligand_rmsd_angstrom(ligand, at_x(4), at_x(4)), 0);
  // Half a turn about x moves each corner to the opposite one, i.e. by 2 √2 Å.
  const Pose half_turn = turned(Vec3::UnitX(), std::numbers::pi, {4, 0, 0});
  EXPECT_NEAR(ligand_rmsd_angstrom(ligand, at_x(4), half_turn), 2 * std::numbers::sqrt2, 1e-12);
  add_atom(ligand, "1", "H1", {0, 50, 0}, "H");
  EXPECT_NEAR(ligand_rmsd_angstrom(ligand, at_x(4), half_turn), 2 * std::numbers::sqrt2, 1e-12);
}

TEST(Capri, InterfaceRmsdOfEqualHalvesDrawnApartIsHalfTheWay) {
  const docking::Molecule a = square(), b = square();
  EXPECT_NEAR(interface_rmsd_angstrom(a, b, at_x(4), at_x(4)), 0, 1e-9);
  // The second molecule is 3 Å farther away than in the native pose. Both molecules have four atoms, so the optimal
  // superposition moves each by half of the 3 Å. Every atom then deviates by 1.5 Å. A rotation cannot reduce this
  // deviation.
  EXPECT_NEAR(interface_rmsd_angstrom(a, b, at_x(4), at_x(7)), 1.5, 1e-9);
  // Molecules with different numbers of atoms, n = 4 and m = 1: the optimal superposition moves each molecule in
  // proportion to the other's number of atoms. The RMSD is the displacement of 3 Å times √(n m) / (n + m) = 2/5.
  docking::Molecule single;
  add_atom(single, "1", "C1", Vec3::Zero());
  EXPECT_NEAR(interface_rmsd_angstrom(a, single, at_x(4), at_x(7)), 3 * 2.0 / 5, 1e-9);
}

TEST(Capri, InterfaceRmsdOfATurnAboutTheLineOfSquaresIsThatOfHalfTheTurn) {
  // The second square is rotated by `angle`. The optimal superposition rotates both squares by half of it, so each
  // square is off by angle / 2. A corner is √2 Å from the axis and deviates by the chord 2 √2 sin(angle / 4) Å.
  const double angle = 0.8;
  const Pose X_AB = turned(Vec3::UnitX(), angle, {4, 0, 0});
  EXPECT_NEAR(interface_rmsd_angstrom(square(), square(), at_x(4), X_AB), 2 * std::numbers::sqrt2 * std::sin(angle / 4),
              1e-9);
}

TEST(Capri, MeasuresAreTheSameWhicheverMoleculeIsTheReceptor) {
  std::mt19937 random(20261130);
  docking::Molecule a, b;
  std::uniform_real_distribution<double> uniform(-6, 6);
  for (int i = 0; i < 60; ++i) {
    const Vec3 place(uniform(random), uniform(random), uniform(random));
    add_atom(i % 2 == 0 ? a : b, std::to_string(i / 6), "C" + std::to_string(i), place);
  }
  const Pose native{{7, 1, -2}, test::random_rotation(random)};
  const Pose X_AB = native * turned(Vec3::UnitZ(), 0.3, {1, 0.5, -1});
  const double rmsd = interface_rmsd_angstrom(a, b, native, X_AB), share = native_contact_share(a, b, native, X_AB);
  EXPECT_GT(rmsd, 0.1);
  EXPECT_GT(share, 0);
  EXPECT_LT(share, 1);
  EXPECT_NEAR(interface_rmsd_angstrom(b, a, native.inverse(), X_AB.inverse()), rmsd, 1e-9);
  EXPECT_EQ(native_contact_share(b, a, native.inverse(), X_AB.inverse()), share);
}

TEST(Capri, InterfaceIsTheBackboneOfResiduesWithinTenAngstrom) {
  docking::Molecule a, b;
  const auto add_amino_acid = [](docking::Molecule& molecule, const std::string& id, double x) {
    add_atom(molecule, id, "N", {x, -1, 0}, "N");
    add_atom(molecule, id, "CA", {x, 0, 0});
    add_atom(molecule, id, "C", {x, 1, 0});
    add_atom(molecule, id, "O", {x, 2, 0}, "O");
  };
  add_amino_acid(a, "1", 0);
  add_amino_acid(b, "1", 0);
  // Adds a side-chain atom, and a residue beyond the reach of the interface. If either were included, the two molecules
  // would have different numbers of atoms, and the deviation would not be 1 Å.
  add_atom(a, "1", "CB", {0, 0, 3});
  add_amino_acid(a, "2", -2.5);
  EXPECT_NEAR(interface_rmsd_angstrom(a, b, at_x(8), at_x(10)), 1, 1e-9);
  // A calcium ion has the name CA, like the α carbon of an amino acid, but it is a residue of its own and must count
  // with all its atoms. With the ion, molecule a has n = 5 interface atoms and molecule b has m = 4: the RMSD is 2 Å ·
  // √(n m) / (n + m).
  add_atom(a, "3", "CA", {0, 0.5, 0}, "CA");
  EXPECT_NEAR(interface_rmsd_angstrom(a, b, at_x(8), at_x(10)), 2 * std::sqrt(20.0) / 9, 1e-9);
  EXPECT_TRUE(std::isnan(interface_rmsd_angstrom(a, b, at_x(30), at_x(8))));
}

TEST(Capri, OfANucleotideTheSugarAndPhosphateAreTheBackbone) {
  docking::Molecule a, b;
  double y = 0;
  for (const char* const name : {"P", "O5'", "C5'", "C4'", "C3'", "O3'"}) add_atom(a, "1", name, {0, y++, 0});
  add_atom(a, "1", "N9", {0, 2, 1});
  add_atom(b, "1", "C1", {0, 2.5, 0});
  // Molecule a has six backbone atoms on a line. Molecule b has one atom, which moves through the middle of this line.
  EXPECT_NEAR(interface_rmsd_angstrom(a, b, at_x(4), at_x(5)), std::sqrt(6.0) / 7, 1e-9);
}

TEST(Capri, NativeContactsAreResiduesWithinFiveAngstromOfHeavyAtoms) {
  // Two parallel rows of three residues are 4 Å apart, so opposite residues are in contact (limit 5 Å). Other pairs are
  // not: they are at least √(4² + 6²) = 7.2 Å apart.
  const docking::Molecule a = row_of_residues(3, 6), b = row_of_residues(3, 6);
  EXPECT_EQ(residue_pairs_within(a, b, at_x(4), kResidueContact_angstrom), (Pairs{{0, 0}, {1, 1}, {2, 2}}));
  EXPECT_EQ(native_contact_share(a, b, at_x(4), at_x(4)), 1);
  EXPECT_EQ(native_contact_share(a, b, at_x(4), at_x(5)), 1) << "5 Å is within 5 Å";
  EXPECT_EQ(native_contact_share(a, b, at_x(4), at_x(5.01)), 0);
  // The second row is rotated about its first residue (k = 0). Residue k is 6 k Å from the axis and moves by the chord
  // 12 k sin(angle / 2) Å. Its contact is lost if the chord exceeds √(5² − 4²) = 3 Å.
  EXPECT_NEAR(native_contact_share(a, b, at_x(4), turned(Vec3::UnitX(), 0.4, {4, 0, 0})), 2.0 / 3, 1e-12);
  EXPECT_NEAR(native_contact_share(a, b, at_x(4), turned(Vec3::UnitX(), 0.6, {4, 0, 0})), 1.0 / 3, 1e-12);
  // A shift by one residue along the row replaces every native contact by another contact.
  EXPECT_EQ(native_contact_share(a, b, at_x(4), {{4, 6, 0}, Quat::Identity()}), 0);
  EXPECT_TRUE(std::isnan(native_contact_share(a, b, at_x(30), at_x(4))));
}

TEST(Capri, HydrogensMakeNoContact) {
  docking::Molecule a = row_of_residues(1, 1);
  const docking::Molecule b = row_of_residues(1, 1);
  add_atom(a, "1", "H1", {1, 0, 0}, "H");
  EXPECT_TRUE(residue_pairs_within(a, b, at_x(5.5), kResidueContact_angstrom).empty());
}

}  // namespace
}  // namespace tandem::lab
