// Compares built hydrogens with the positions that GROMACS computes, and tests united atoms.
#include "server/assets/structures/hydrogens.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <numeric>
#include <sstream>
#include <string>

#include "server/assets/structures/loader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::server {
namespace {

const std::filesystem::path k1ubqFile = "/usr/share/freesasa/test-data/1ubq.pdb";

double total(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

class Ubiquitin : public testing::Test {
 protected:
  void SetUp() override { TANDEM_NEEDS_FILES(test::kOplsDirectory, k1ubqFile); }
};

TEST_F(Ubiquitin, EveryBuiltHydrogenIsWhereGromacsPutsIt) {
  std::map<std::string, Vec3> expected;
  std::ifstream golden(test::source_path("tests/golden/1ubq_hydrogens.txt"));
  ASSERT_TRUE(golden);
  for (std::string line; std::getline(golden, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    std::string residue, name;
    Vec3 p;
    words >> residue >> name >> p.x() >> p.y() >> p.z();
    expected[name + " of " + residue] = p;
  }
  ASSERT_EQ(expected.size(), 629U);
  StructureReport report;
  const docking::Molecule molecule = load_molecule(k1ubqFile, {}, test::kOplsDirectory, Hydrogens::kBuild, &report);
  EXPECT_EQ(molecule.size(), 602U + 629U);
  EXPECT_TRUE(report.missing.empty()) << report.missing.front();
  EXPECT_TRUE(molecule.guessed.empty()) << molecule.guessed.begin()->second;
  EXPECT_EQ(report.hydrogens, "build");
  EXPECT_NEAR(total(molecule.charge_e), 0, 1e-9);
  std::size_t compared = 0, moved = 0;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    // An entry has the form "HB1 of MET 1 of chain A".
    std::istringstream words(report.places[i]);
    std::string name, of, residue_name, residue;
    words >> name >> of >> residue_name >> residue;
    const auto found = expected.find(name + " of " + residue);
    if (!name.starts_with('H')) continue;
    ASSERT_NE(found, expected.end()) << report.places[i];
    // The golden file has positions in nm with three decimals. Built hydrogens that were not moved therefore agree
    // within 0.002 Å.
    const double apart = (molecule.positions_angstrom[i] - found->second).norm();
    if (apart >= 0.002) ++moved;
    // Hydrogens that overlap atoms of other residues are moved, by less than 0.3 Å.
    EXPECT_LT(apart, 0.3) << report.places[i];
    ++compared;
  }
  EXPECT_EQ(compared, 629U);
  EXPECT_LE(report.moved.size(), 2U);
  EXPECT_LE(moved, 2 * report.moved.size());
}

TEST_F(Ubiquitin, UnitedAtomsKeepTheChargeAndTheMassAndOnlyPolarHydrogens) {
  const docking::Molecule all = load_molecule(k1ubqFile, {}, test::kOplsDirectory, Hydrogens::kBuild);
  const docking::Molecule united = load_molecule(k1ubqFile, {}, test::kOplsDirectory, Hydrogens::kUnited);
  EXPECT_NEAR(total(united.charge_e), total(all.charge_e), 1e-9);
  // United atoms have the masses of the force field. For an aromatic CH, the force field gives the mass of the carbon
  // only. The expected sum therefore lacks the masses of 16 hydrogens: those of one TYR, two PHE and one HIS.
  EXPECT_NEAR(total(united.mass_u), total(all.mass_u) - 16 * 1.008, 0.01);
  std::size_t hydrogens = 0;
  for (std::size_t i = 0; i < united.size(); ++i) {
    if (!united.atom_names[i].starts_with('H')) continue;
    ++hydrogens;
    EXPECT_EQ(united.sigma_angstrom[i], 0) << united.atom_names[i] << " of " << united.residue_names[i];
  }
  EXPECT_EQ(united.size(), 602U + hydrogens);
  EXPECT_EQ(hydrogens, 144U);
  EXPECT_EQ(std::count(united.types.begin(), united.types.end(), "opls_005"), 6) << "glycines";
}

TEST_F(Ubiquitin, HydrogensOfTheFileAreReplaced) {
  const std::filesystem::path with = "/usr/share/freesasa/test-data/1d3z.pdb";
  TANDEM_NEEDS_FILES(with);
  const docking::Molecule built = load_molecule(with, {}, test::kOplsDirectory, Hydrogens::kBuild);
  const docking::Molecule given = load_molecule(with, {}, test::kOplsDirectory);
  EXPECT_EQ(built.size(), 1231U);
  EXPECT_EQ(given.size(), 1231U);
  double farthest = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    farthest = std::max(farthest, (built.positions_angstrom[i] - given.positions_angstrom[i]).norm());
  }
  EXPECT_GT(farthest, 0.01);
}

/// Fails for an implementation that follows GROMACS's rule literally: one hydrogen on the proline's N would be only
/// 0.66 Å from the ring atom CD.
TEST(BuiltHydrogens, OfAProlineThatBeginsAChainAreAwayFromItsRing) {
  const std::filesystem::path protease = "/usr/share/pymol/data/tut/1hpv.pdb";
  TANDEM_NEEDS_FILES(test::kOplsDirectory, protease);
  const docking::Molecule built = load_molecule(protease, {{"A"}}, test::kOplsDirectory, Hydrogens::kBuild);
  std::map<std::string, std::size_t> of_proline;
  for (std::size_t i = 0; i < built.size() && built.residue_ids[i] == "1"; ++i) of_proline[built.atom_names[i]] = i;
  const auto distance = [&built](std::size_t i, std::size_t k) {
    return (built.positions_angstrom[i] - built.positions_angstrom[k]).norm();
  };
  for (const char* const hydrogen : {"H1", "H2"}) {
    ASSERT_TRUE(of_proline.contains(hydrogen));
    EXPECT_EQ(built.types[of_proline[hydrogen]], "opls_310");
    EXPECT_NEAR(distance(of_proline[hydrogen], of_proline["N"]), 1, 1e-9);
    EXPECT_GT(distance(of_proline[hydrogen], of_proline["CD"]), 1.7);
    EXPECT_GT(distance(of_proline[hydrogen], of_proline["CA"]), 1.7);
  }
}

TEST(BuiltHydrogens, AreLeftOutWhereAnAtomIsMissing) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  // CB is missing, and all given atoms are collinear, so no perpendicular direction is defined. An implementation that
  // divides by zero here would give positions that are not finite.
  const test::PdbFile file(test::residue_text("ALA", "N CA C O", 1) + test::residue_text("GLY", "N CA C O", 2));
  StructureReport report;
  const docking::Molecule molecule = load_molecule(file.path(), {}, test::kOplsDirectory, Hydrogens::kBuild, &report);
  for (const Vec3& p : molecule.positions_angstrom) EXPECT_TRUE(is_finite(p));
  EXPECT_FALSE(report.missing.empty());
}

TEST(BuiltHydrogens, AChainThatEndsOnALineHasNoSecondOxygen) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  std::string text;
  for (const auto& [name, x] : std::map<std::string, double>{{" N  ", 0}, {" CA ", 1.5}, {" C  ", 3}, {" O  ", 4.5}}) {
    test::PdbLine line;
    line.name = name;
    line.x = x;
    text += test::to_text(line);
  }
  const test::PdbFile file(text);
  StructureReport report;
  load_molecule(file.path(), {}, test::kOplsDirectory, Hydrogens::kBuild, &report);
  EXPECT_TRUE(report.built.empty()) << report.built.front();
}

}  // namespace
}  // namespace tandem::server
