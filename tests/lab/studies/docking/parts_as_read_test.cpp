// Tests the check for a complex with constructed parts, some of which form a complex and some of which do not.
#include "lab/studies/docking/parts_as_read.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "tests/support/molecules.hpp"

namespace tandem::lab {
namespace {

/// Returns a molecule of one atom at the origin. The atom is in chain `chain`, in a residue named `residue` with the
/// number 7.
docking::Molecule part(const std::string& name, const std::string& element, const std::string& residue,
                       const std::string& chain) {
  docking::Molecule made = test::one_atom(3.4, 0.4);
  made.atom_names = {name};
  made.elements = {element};
  made.residue_names = {residue};
  made.residue_ids = {"7"};
  made.chains = {chain};
  made.segments = {0};
  return made;
}

/// Returns the reason why parts at this distance are refused, or an empty text if they are accepted.
std::string refusal_at(const docking::Molecule& a, const docking::Molecule& b, double distance_angstrom) {
  try {
    require_complex_as_read(a, b, {Vec3(0, distance_angstrom, 0), Quat::Identity()});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

void expect_texts(const std::string& message, std::initializer_list<const char*> texts) {
  for (const char* const text : texts) {
    EXPECT_NE(message.find(text), std::string::npos) << text << " in: " << message;
  }
}

TEST(PartsAsRead, InContactAreAComplex) {
  const docking::Molecule a = part("CB", "C", "ALA", "A"), b = part("CB", "C", "ALA", "B");
  EXPECT_EQ(refusal_at(a, b, 3.5), "");
  EXPECT_EQ(refusal_at(a, b, 4.99), "");
}

TEST(PartsAsRead, ApartAreRefusedWithTheDistanceAndTheRemedy) {
  expect_texts(refusal_at(part("CB", "C", "ALA", "A"), part("CB", "C", "LEU", "B"), 23.5),
               {"no residues are within 5 Å", "CB of ALA 7 of chain A and CB of LEU 7 of chain B are 23.50 Å apart",
                "in the same frame"});
}

TEST(PartsAsRead, AtOnePlaceAreRefusedAsOverlapping) {
  expect_texts(refusal_at(part("CB", "C", "ALA", "A"), part("CB", "C", "ALA", ""), 0.1),
               {"overlap", "CB of ALA 7 are 0.10 Å apart", "name two parts of one complex"});
}

TEST(PartsAsRead, BondedAreRefusedByNamesAndDistance) {
  const docking::Molecule sulphur_a = part("SG", "S", "CYS", "A"), sulphur_b = part("SG", "S", "CYS", "B");
  expect_texts(refusal_at(sulphur_a, sulphur_b, 2.03), {"a bond joins", "2.03 Å apart", "without a bond"});
  EXPECT_EQ(refusal_at(sulphur_a, sulphur_b, 2.6), "");
  const docking::Molecule c = part("C", "C", "GLY", "A"), n = part("N", "N", "GLY", "B");
  expect_texts(refusal_at(c, n, 1.33), {"a bond joins"});
  expect_texts(refusal_at(n, c, 1.33), {"a bond joins"});
  EXPECT_EQ(refusal_at(c, n, 2.8), "");
  EXPECT_EQ(refusal_at(c, part("O", "O", "GLY", "B"), 1.33), "") << "an overlap, which the field separates";
}

TEST(PartsAsRead, NearestAtomsAreHeavyAndFoundAmongAll) {
  docking::Molecule a = part("CB", "C", "ALA", "A");
  const docking::Molecule b = part("CB", "C", "ALA", "B");
  for (const auto& [name, element, y] : {std::tuple("CG", "C", 2.0), std::tuple("HG", "H", 3.0)}) {
    a.positions_angstrom.emplace_back(0, y, 0);
    a.atom_names.emplace_back(name);
    a.elements.emplace_back(element);
  }
  const auto nearest = nearest_atoms(a, b, {Vec3(0, 4, 0), Quat::Identity()});
  ASSERT_TRUE(nearest.has_value());
  EXPECT_EQ(*nearest, std::pair(std::size_t{1}, std::size_t{0}));
}

TEST(PartsAsRead, StrongestRepulsionNamesTheResiduesWithTheirEnergy) {
  // Two equal atoms at r = σ (1 / 2)^(1/6) have the energy 4 ε (4 − 2) = 8 ε = 3.2 kJ/mol, i.e. 0.76 kcal/mol. Each
  // molecule has one atom, so this is also the energy of each residue.
  const docking::Molecule a = part("CB", "C", "ALA", "A"), b = part("CB", "C", "LEU", "B");
  const double r = 3.4 * std::pow(0.5, 1.0 / 6);
  const std::string text = strongest_repulsion_text(a, b, {Vec3(r, 0, 0), Quat::Identity()});
  EXPECT_EQ(text, "ALA 7 of chain A (0.8 kcal/mol) and LEU 7 of chain B (0.8 kcal/mol)");
}

}  // namespace
}  // namespace tandem::lab
