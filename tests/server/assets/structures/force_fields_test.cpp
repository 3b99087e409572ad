// Tests the force fields of GROMACS other than OPLS-AA. Supported force fields must give exact parameters; all others
// must be refused rather than misread.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>
#include <string>

#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/loader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

namespace fs = std::filesystem;
using test::residue_text;

fs::path folder_of(const std::string& name) {
  return test::kOplsDirectory.parent_path() / (name + ".ff");
}

std::string refusal(const fs::path& folder) {
  try {
    load_force_field(folder);
  } catch (const docking::MoleculeError& error) {
    return error.what();
  }
  return "";
}

class ForceFields : public testing::Test {
 protected:
  void SetUp() override { TANDEM_NEEDS_FILES(test::kOplsDirectory); }
};

/// Tests of force fields that combine the Lennard-Jones diameters σ of two atoms by the arithmetic mean.
class ArithmeticForceField : public ForceFields, public testing::WithParamInterface<const char*> {
 protected:
  static docking::Molecule load(const std::string& text, Hydrogens hydrogens = Hydrogens::kGiven) {
    const test::PdbFile file(text);
    return load_molecule(file.path(), {}, folder_of(GetParam()), hydrogens);
  }
};

INSTANTIATE_TEST_SUITE_P(Debian, ArithmeticForceField,
                         testing::Values("amber03", "amber94", "amber96", "amber99", "amber99sb", "amber99sb-ildn",
                                         "amberGS", "charmm27"));

struct Chain {
  std::string text;
  double charge_e;
};

const std::string kBackbone = "N H CA HA C O CB ";

/// Returns chains that together contain all residues and protonation states. Each residue stands within its chain:
/// after a cap, and before a charged end.
std::vector<Chain> chains() {
  const auto capped = [](const std::string& name, const std::string& atoms) {
    return residue_text("ACE", "C O CH3 H1 H2 H3", 1) + residue_text(name, atoms, 2) +
           residue_text("GLY", "N H CA HA2 HA3 C O OXT", 3);
  };
  const std::string to_cg = kBackbone + "HB2 HB3 CG ", ring = " CD2 HD2 CE1 HE1 NE2";
  const std::string to_ce = to_cg + "HG2 HG3 CD HD2 HD3 CE HE2 HE3 NZ HZ1 HZ2 ";
  return {
      {residue_text("ALA", "N H1 H2 H3 CA HA CB HB1 HB2 HB3 C O", 1) + residue_text("GLY", "N H CA HA2 HA3 C O OXT", 2),
       0},
      {residue_text("PRO", "N H2 H3 CA HA CB HB2 HB3 CG HG2 HG3 CD HD2 HD3 C O", 1) +
           residue_text("ILE", kBackbone + "HB CG1 HG12 HG13 CG2 HG21 HG22 HG23 CD1 HD11 HD12 HD13 OXT", 2),
       0},
      {capped("ARG", to_cg + "HG2 HG3 CD HD2 HD3 NE HE CZ NH1 HH11 HH12 NH2 HH21 HH22"), 0},
      {capped("ASN", to_cg + "OD1 ND2 HD21 HD22"), -1},
      {capped("ASP", to_cg + "OD1 OD2"), -2},
      {capped("ASP", to_cg + "OD1 OD2 HD2"), -1},
      {capped("CYS", kBackbone + "HB2 HB3 SG HG"), -1},
      {capped("CYX", kBackbone + "HB2 HB3 SG"), -1},
      {capped("GLN", to_cg + "HG2 HG3 CD OE1 NE2 HE21 HE22"), -1},
      {capped("GLU", to_cg + "HG2 HG3 CD OE1 OE2"), -2},
      {capped("GLU", to_cg + "HG2 HG3 CD OE1 OE2 HE1"), -1},
      {capped("HIS", to_cg + "ND1 HD1" + ring), -1},
      {capped("HIS", to_cg + "ND1" + ring + " HE2"), -1},
      {capped("HIS", to_cg + "ND1 HD1" + ring + " HE2"), 0},
      {capped("LEU", to_cg + "HG CD1 HD11 HD12 HD13 CD2 HD21 HD22 HD23"), -1},
      {capped("LYS", to_ce + "HZ3"), 0},
      {capped("LYS", to_ce), -1},
      {capped("MET", to_cg + "HG2 HG3 SD CE HE1 HE2 HE3"), -1},
      {capped("PHE", to_cg + "CD1 HD1 CD2 HD2 CE1 HE1 CE2 HE2 CZ HZ"), -1},
      {capped("SER", kBackbone + "HB2 HB3 OG HG"), -1},
      {capped("THR", kBackbone + "HB OG1 HG1 CG2 HG21 HG22 HG23"), -1},
      {capped("TRP", to_cg + "CD1 HD1 CD2 NE1 HE1 CE2 CE3 HE3 CZ2 HZ2 CZ3 HZ3 CH2 HH2"), -1},
      {capped("TYR", to_cg + "CD1 HD1 CD2 HD2 CE1 HE1 CE2 HE2 CZ OH HH"), -1},
      {capped("VAL", kBackbone + "HB CG1 HG11 HG12 HG13 CG2 HG21 HG22 HG23"), -1},
  };
}

TEST_P(ArithmeticForceField, TypesEveryAminoAcidAndChargedEndExactly) {
  for (const Chain& chain : chains()) {
    const docking::Molecule molecule = load(chain.text);
    EXPECT_TRUE(molecule.mixes_arithmetically);
    EXPECT_EQ(molecule.force_field, GetParam());
    EXPECT_NEAR(std::accumulate(molecule.charge_e.begin(), molecule.charge_e.end(), 0.0), chain.charge_e, 1e-4)
        << chain.text;
    EXPECT_TRUE(molecule.guessed.empty()) << molecule.guessed.begin()->second;
    EXPECT_THAT(molecule.notes, testing::ElementsAre(testing::StartsWith("net charge "))) << chain.text;
  }
}

TEST_P(ArithmeticForceField, BuildsTheHydrogensOfItsBlocksAndNothingElse) {
  const char* const file = "/usr/share/pymol/test/dat/3al1.pdb";
  TANDEM_NEEDS_FILES(file);
  const docking::Molecule molecule = load_molecule(file, {{"A"}}, folder_of(GetParam()), Hydrogens::kBuild);
  EXPECT_EQ(molecule.size(), load_molecule(file, {{"A"}}, test::kOplsDirectory, Hydrogens::kBuild).size());
  EXPECT_TRUE(molecule.guessed.empty()) << molecule.guessed.begin()->second;
}

TEST_P(ArithmeticForceField, MakesEveryHydrogenByOneRule) {
  const ForceField force_field = load_force_field(folder_of(GetParam()));
  for (const auto& [block, rules] : force_field.hydrogens) {
    std::set<std::string> made;
    for (const HydrogenRule& rule : rules) {
      for (int n = 0; n < rule.count; ++n)
        EXPECT_TRUE(made.insert(rule.hydrogen(n)).second) << rule.name << " of " << block;
    }
  }
  EXPECT_GT(force_field.hydrogens.size(), 20U);
}

TEST_P(ArithmeticForceField, AtomsWithoutAnEntryAreGuessedByElement) {
  const docking::Molecule molecule = load(residue_text("ALA", "N H CA HA CB HB1 HB2 HB3 C O S9 XX", 1));
  ASSERT_EQ(molecule.guessed.size(), 2U);
  EXPECT_EQ(molecule.types[10], "element S");
  EXPECT_DOUBLE_EQ(molecule.sigma_angstrom[10], 3.55);
  EXPECT_EQ(molecule.charge_e[10], 0);
  EXPECT_EQ(molecule.types[11], "element C");
}

TEST_P(ArithmeticForceField, RefusesUnitedAtomsWithAReason) {
  try {
    load(residue_text("ALA", "N CA CB C O", 1), Hydrogens::kUnited);
    FAIL() << "atoms were united";
  } catch (const docking::MoleculeError& error) {
    EXPECT_NE(std::string(error.what()).find(std::string(GetParam()) + " has no united atoms"), std::string::npos)
        << error.what();
  }
}

TEST_F(ForceFields, ParametersByPairAreRefusedWithTheFileAndTheRemedy) {
  for (const char* const name : {"gromos43a1", "gromos54a7"}) {
    const std::string message = refusal(folder_of(name));
    EXPECT_NE(message.find(std::string(name) + ".ff/forcefield.itp:"), std::string::npos) << message;
    EXPECT_NE(message.find("comb-rule 2 or 3"), std::string::npos) << message;
    EXPECT_NE(message.find("name another folder"), std::string::npos) << message;
  }
}

TEST_F(ForceFields, AreFoundByTheirNames) {
  EXPECT_EQ(load_force_field("charmm27").name, "charmm27");
  EXPECT_NE(refusal("amber2000").find("/amber2000.ff does not exist"), std::string::npos) << refusal("amber2000");
}

TEST(ForceFieldFiles, ParametersOfPairsOfTypesAreRefused) {
  const fs::path folder = fs::temp_directory_path() / ("tandem_pairs_" + std::to_string(getpid()) + ".ff");
  fs::create_directory(folder);
  std::ofstream(folder / "forcefield.itp") << "[ defaults ]\n1 2 yes 0.5 0.8333\n";
  std::ofstream(folder / "ffnonbonded.itp")
      << "[ atomtypes ]\nC C 6 12.0 0.0 A 0.35 0.3\n[ nonbond_params ]\nC C 1 0.3 0.3\n";
  const std::string message = refusal(folder);
  EXPECT_NE(message.find("ffnonbonded.itp:3: "), std::string::npos) << message;
  std::error_code ignored;
  fs::remove_all(folder, ignored);
}

TEST_F(ForceFields, ChargedEndsOfAmberHaveTheirOwnBlocks) {
  const test::PdbFile file(residue_text("ALA", "N H1 H2 H3 CA HA CB HB1 HB2 HB3 C O", 1) +
                           residue_text("ALA", "N H CA HA CB HB1 HB2 HB3 C O OXT", 2));
  const docking::Molecule molecule = load_molecule(file.path(), {}, folder_of("amber99sb"));
  EXPECT_DOUBLE_EQ(molecule.charge_e[0], 0.1414) << "N of NALA";
  EXPECT_DOUBLE_EQ(molecule.charge_e[12], -0.3821) << "N of CALA";
  EXPECT_DOUBLE_EQ(molecule.charge_e[22], -0.8055) << "OC2 of CALA";
  EXPECT_EQ(molecule.types[22], "O2");
}

}  // namespace
}  // namespace tandem::server
