// Tests the parameters that a structure file gets from the OPLS-AA files of GROMACS. They must be exact where an entry
// exists; every other atom must be reported by name.
#include "server/assets/structures/loader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string>

#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/residue_typing.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

using test::PdbFile;
using test::residue_text;

const std::string kAcetyl = test::residue_text("ACE", "C O CH3 H1 H2 H3", 4);
const std::string kAmide = test::residue_text("NH2", "N HN1 HN2", 6);

double total_charge(const docking::Molecule& molecule) {
  return std::accumulate(molecule.charge_e.begin(), molecule.charge_e.end(), 0.0);
}

class OplsLoader : public testing::Test {
 protected:
  void SetUp() override { TANDEM_NEEDS_FILES(test::kOplsDirectory); }

  static docking::Molecule load(const std::string& text, const std::vector<std::string>& chains = {}) {
    const PdbFile file(text);
    return load_molecule(file.path(), {chains}, test::kOplsDirectory);
  }

  static std::string type_of(const docking::Molecule& molecule, const std::string& residue, const std::string& atom) {
    for (std::size_t i = 0; i < molecule.size(); ++i) {
      if (molecule.residue_names[i] == residue && molecule.atom_names[i] == atom) return molecule.types[i];
    }
    return "no atom " + atom;
  }

  static std::string message_of(const std::string& text, const std::vector<std::string>& chains = {}) {
    try {
      load(text, chains);
    } catch (const docking::MoleculeError& error) {
      return error.what();
    }
    return "";
  }
};

struct ResidueCase {
  std::string name;
  std::string atoms;  ///< atom names of the remediated PDB format
  double charge_e;
  std::string probe;  ///< name of the atom whose type is compared with `type`
  std::string type;
};

const std::string kLoadedBackbone = "N H CA HA C O ";

const ResidueCase kResidues[] = {
    {"ALA", kLoadedBackbone + "CB HB1 HB2 HB3", 0, "CB", "opls_135"},
    {"ARG", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 CD HD2 HD3 NE HE CZ NH1 HH11 HH12 NH2 HH21 HH22", 1, "CZ",
     "opls_302"},
    {"ASN", kLoadedBackbone + "CB HB2 HB3 CG OD1 ND2 HD21 HD22", 0, "ND2", "opls_237"},
    {"ASP", kLoadedBackbone + "CB HB2 HB3 CG OD1 OD2", -1, "OD2", "opls_272"},
    {"ASP", kLoadedBackbone + "CB HB2 HB3 CG OD1 OD2 HD2", 0, "OD2", "opls_268"},
    {"ASP", kLoadedBackbone + "CB HB2 HB3 CG OD1 HD1 OD2", 0, "OD1", "opls_268"},
    {"ASH", kLoadedBackbone + "CB HB2 HB3 CG OD1 OD2 HD2", 0, "HD2", "opls_270"},
    {"CYS", kLoadedBackbone + "CB HB2 HB3 SG HG", 0, "SG", "opls_200"},
    {"CYX", kLoadedBackbone + "CB HB2 HB3 SG", 0, "SG", "opls_203"},
    {"GLN", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 CD OE1 NE2 HE21 HE22", 0, "HE21", "opls_240"},
    {"GLU", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 CD OE1 OE2", -1, "CG", "opls_274"},
    {"GLU", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 CD OE1 OE2 HE2", 0, "CG", "opls_136"},
    {"GLY", "N H CA HA2 HA3 C O", 0, "CA", "opls_223B"},
    {"HIS", kLoadedBackbone + "CB HB2 HB3 CG ND1 HD1 CD2 HD2 CE1 HE1 NE2", 0, "ND1", "opls_503"},
    {"HIS", kLoadedBackbone + "CB HB2 HB3 CG ND1 CD2 HD2 CE1 HE1 NE2 HE2", 0, "ND1", "opls_511"},
    {"HIS", kLoadedBackbone + "CB HB2 HB3 CG ND1 HD1 CD2 HD2 CE1 HE1 NE2 HE2", 1, "CE1", "opls_509"},
    {"HSP", kLoadedBackbone + "CB HB2 HB3 CG ND1 HD1 CD2 HD2 CE1 HE1 NE2 HE2", 1, "ND1", "opls_512"},
    {"ILE", kLoadedBackbone + "CB HB CG1 HG12 HG13 CG2 HG21 HG22 HG23 CD1 HD11 HD12 HD13", 0, "CD1", "opls_135"},
    {"LEU", kLoadedBackbone + "CB HB2 HB3 CG HG CD1 HD11 HD12 HD13 CD2 HD21 HD22 HD23", 0, "CG", "opls_137"},
    {"LYS", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 CD HD2 HD3 CE HE2 HE3 NZ HZ1 HZ2 HZ3", 1, "NZ", "opls_287"},
    {"LYS", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 CD HD2 HD3 CE HE2 HE3 NZ HZ1 HZ2", 0, "NZ", "opls_900"},
    {"MET", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 SD CE HE1 HE2 HE3", 0, "SD", "opls_202"},
    {"PHE", kLoadedBackbone + "CB HB2 HB3 CG CD1 HD1 CD2 HD2 CE1 HE1 CE2 HE2 CZ HZ", 0, "HZ", "opls_146"},
    {"PRO", "N CA HA C O CB HB2 HB3 CG HG2 HG3 CD HD2 HD3", 0, "N", "opls_239"},
    {"SER", kLoadedBackbone + "CB HB2 HB3 OG HG", 0, "OG", "opls_154"},
    {"THR", kLoadedBackbone + "CB HB OG1 HG1 CG2 HG21 HG22 HG23", 0, "CB", "opls_158"},
    {"TRP", kLoadedBackbone + "CB HB2 HB3 CG CD1 HD1 CD2 NE1 HE1 CE2 CE3 HE3 CZ2 HZ2 CZ3 HZ3 CH2 HH2", 0, "NE1",
     "opls_503"},
    {"TYR", kLoadedBackbone + "CB HB2 HB3 CG CD1 HD1 CD2 HD2 CE1 HE1 CE2 HE2 CZ OH HH", 0, "OH", "opls_167"},
    {"VAL", kLoadedBackbone + "CB HB CG1 HG11 HG12 HG13 CG2 HG21 HG22 HG23", 0, "CB", "opls_137"},
};

TEST_F(OplsLoader, TypesEveryAminoAcidExactlyWithAWholeCharge) {
  for (const ResidueCase& residue : kResidues) {
    const docking::Molecule molecule = load(kAcetyl + test::residue_text(residue.name, residue.atoms, 5) + kAmide);
    EXPECT_NEAR(total_charge(molecule), residue.charge_e, 1e-9) << residue.name << " " << residue.atoms;
    EXPECT_EQ(type_of(molecule, residue.name, residue.probe), residue.type) << residue.name << " " << residue.atoms;
    EXPECT_TRUE(molecule.guessed.empty()) << molecule.guessed.begin()->second;
    EXPECT_THAT(molecule.notes, testing::ElementsAre(testing::StartsWith("net charge "))) << residue.atoms;
  }
}

TEST_F(OplsLoader, AcceptsTheOldNamesOfHydrogens) {
  const docking::Molecule remediated = load(kAcetyl + test::residue_text("ILE", kResidues[17].atoms, 5) + kAmide);
  const docking::Molecule old = load(
      test::residue_text("ACE", "C O CH3 1H 2H 3H", 1) +
      test::residue_text("ILE", "N HN CA HA C O CB HB CG1 1HG1 2HG1 CG2 1HG2 2HG2 3HG2 CD 1HD1 2HD1 3HD1", 5) + kAmide);
  EXPECT_EQ(old.types, remediated.types);
  EXPECT_EQ(old.charge_e, remediated.charge_e);
  EXPECT_TRUE(old.guessed.empty()) << old.guessed.begin()->second;
}

TEST_F(OplsLoader, EditsTheChainEnds) {
  const std::string charged = test::residue_text("ALA", "N H1 H2 H3 CA HA CB HB1 HB2 HB3 C O", 1) +
                              test::residue_text("GLY", "N H CA HA2 HA3 C O OXT", 2);
  const docking::Molecule molecule = load(charged);
  EXPECT_EQ(type_of(molecule, "ALA", "N"), "opls_287");
  EXPECT_EQ(type_of(molecule, "ALA", "H3"), "opls_290");
  EXPECT_EQ(type_of(molecule, "ALA", "CA"), "opls_293B");
  EXPECT_EQ(type_of(molecule, "GLY", "OXT"), "opls_272");
  EXPECT_EQ(type_of(molecule, "GLY", "CA"), "opls_284");
  EXPECT_NEAR(total_charge(molecule), 0.0, 1e-9);
  EXPECT_TRUE(molecule.guessed.empty());

  const docking::Molecule acid = load(kAcetyl + test::residue_text("ALA", "N H CA HA CB HB1 HB2 HB3 C O OXT HXT", 5));
  EXPECT_EQ(type_of(acid, "ALA", "OXT"), "opls_268");
  EXPECT_EQ(type_of(acid, "ALA", "O"), "opls_269");
  EXPECT_NEAR(total_charge(acid), 0.0, 1e-9);

  const docking::Molecule neutral = load(test::residue_text("ALA", "N H1 H2 CA HA CB HB1 HB2 HB3 C O", 1) + kAmide);
  EXPECT_EQ(type_of(neutral, "ALA", "N"), "opls_900");
  EXPECT_NEAR(total_charge(neutral), 0.0, 1e-9);

  const docking::Molecule proline =
      load(test::residue_text("PRO", "N H2 H3 CA HA C O CB HB2 HB3 CG HG2 HG3 CD HD2 HD3", 1) + kAmide);
  EXPECT_EQ(type_of(proline, "PRO", "H3"), "opls_310");
  EXPECT_NEAR(total_charge(proline), 1.0, 1e-9);

  const docking::Molecule zwitterion = load(test::residue_text("ALA", "N H1 H2 H3 CA HA CB HB1 HB2 HB3 C O OXT", 1));
  EXPECT_EQ(type_of(zwitterion, "ALA", "CA"), "opls_299");
  EXPECT_NEAR(total_charge(zwitterion), 0.0, 1e-9);
}

TEST_F(OplsLoader, AChainCutOutOfALongerOneIsNotCharged) {
  const docking::Molecule molecule = load(test::residue_text("ALA", "N H CA HA CB HB1 HB2 HB3 C O", 4));
  EXPECT_EQ(type_of(molecule, "ALA", "N"), "opls_238");
  EXPECT_NEAR(total_charge(molecule), 0.0, 1e-9);
}

/// Returns two cysteines whose sulfurs have no hydrogen (HG) and are `distance` apart [Å].
std::string cysteines(double distance, char second_chain) {
  test::PdbLine sulfur = {.name = " SG ", .residue = "CYS", .number = 1, .z = 30};
  std::string text = test::residue_text("CYS", "N H CA HA CB HB2 HB3 C O", 1) + test::to_text(sulfur);
  text += test::residue_text("CYS", "N H CA HA CB HB2 HB3 C O", 2, second_chain);
  sulfur.number = 2;
  sulfur.chain = second_chain;
  sulfur.z += distance;
  return text + test::to_text(sulfur);
}

TEST_F(OplsLoader, FindsDisulfidesAlsoToChainsThatAreNotLoaded) {
  EXPECT_EQ(type_of(load(cysteines(2.05, 'A')), "CYS", "SG"), "opls_203");
  EXPECT_EQ(type_of(load(cysteines(2.05, 'B'), {"A"}), "CYS", "SG"), "opls_203");
  EXPECT_EQ(type_of(load(cysteines(3.0, 'A')), "CYS", "SG"), "opls_200");
}

TEST_F(OplsLoader, NamesEveryAtomThatItGuesses) {
  test::PdbLine odd = {.name = " XQ1", .residue = "GLY", .number = 5, .x = 40};
  test::PdbLine polar = {.name = " HQ ", .residue = "GLY", .number = 5, .x = 41};
  const docking::Molecule molecule = load(kAcetyl + test::residue_text("GLY", "N H CA HA2 HA3 C O", 5) +
                                          test::to_text(odd) + test::to_text(polar) + kAmide);
  ASSERT_EQ(molecule.guessed.size(), 2U);
  for (const auto& [atom, reason] : molecule.guessed) {
    EXPECT_EQ(molecule.charge_e[atom], 0.0);
    EXPECT_NE(reason.find(molecule.atom_names[atom]), std::string::npos) << reason;
    EXPECT_NE(reason.find("GLY 5 of chain A"), std::string::npos) << reason;
    EXPECT_NE(reason.find(molecule.types[atom]), std::string::npos) << reason;
  }
  EXPECT_EQ(molecule.types[molecule.guessed.begin()->first], "opls_135");
  EXPECT_EQ(molecule.types[molecule.guessed.rbegin()->first], "opls_241");
}

TEST_F(OplsLoader, AHistidineWithoutRingHydrogensIsAGuessOfExactlyFourAtoms) {
  const docking::Molecule molecule =
      load(kAcetyl + test::residue_text("HIS", "N CA C O CB CG ND1 CD2 CE1 NE2", 5) + kAmide);
  std::set<std::string> names;
  for (const auto& [atom, reason] : molecule.guessed) names.insert(molecule.atom_names[atom]);
  EXPECT_EQ(names, (std::set<std::string>{"CG", "ND1", "CD2", "NE2"}));
  EXPECT_EQ(type_of(molecule, "HIS", "NE2"), "opls_503");
}

TEST_F(OplsLoader, ReportsMissingAndOmittedAtoms) {
  const docking::Molecule molecule = load(test::residue_text("ALA", "N CA C O", 1) + test::residue_text("HOH", "O", 2) +
                                          test::residue_text("LIG", "C1 C2", 3));
  std::string notes;
  for (const std::string& note : molecule.notes) notes += note + "\n";
  EXPECT_EQ(molecule.size(), 4U);
  EXPECT_EQ(type_of(molecule, "ALA", "N"), "opls_287");
  EXPECT_NE(notes.find("7 of 7 hydrogens are not in the file"), std::string::npos) << notes;
  EXPECT_NE(notes.find("ALA 1 CB"), std::string::npos) << notes;
  EXPECT_NE(notes.find("left out, no amino acids of oplsaa: 1 residue HOH (1 atom), 1 residue LIG (2 atoms)"),
            std::string::npos)
      << notes;
}

TEST_F(OplsLoader, SelenomethionineIsAMethionineWithTheSizeOfSelenium) {
  const docking::Molecule molecule = load(
      kAcetyl + test::residue_text("MSE", kLoadedBackbone + "CB HB2 HB3 CG HG2 HG3 SE CE HE1 HE2 HE3", 5) + kAmide);
  EXPECT_TRUE(molecule.guessed.empty());
  EXPECT_EQ(type_of(molecule, "MSE", "SE"), "element SE");
  EXPECT_NEAR(total_charge(molecule), 0, 1e-9);
}

TEST_F(OplsLoader, ErrorsNameTheChainsThatAreThere) {
  const std::string text = test::residue_text("ALA", "N CA C O", 1, 'A') +
                           test::residue_text("ALA", "N CA C O", 1, 'C') + test::residue_text("HOH", "O", 2, 'W');
  const std::string message = message_of(text, {"W"});
  EXPECT_NE(
      message.find(
          "chain 'W' has no amino acids or nucleotides of the force field; it has HOH: choose all of it with W/*"),
      std::string::npos)
      << message;
  EXPECT_NE(message.find("A, C"), std::string::npos) << message;
  EXPECT_NE(message_of(test::residue_text("HOH", "O", 2)).find("no protein atoms"), std::string::npos);
  EXPECT_EQ(load(text, {"C"}).size(), 4U);
}

TEST_F(OplsLoader, ReadsTypesInAngstromsAndTheNormalBranchOfIfdef) {
  const ForceField force_field = load_force_field(test::kOplsDirectory);
  EXPECT_EQ(force_field.name, "oplsaa");
  const AtomType& carbon = force_field.type("opls_135");
  EXPECT_DOUBLE_EQ(carbon.sigma_angstrom, 3.5);
  EXPECT_DOUBLE_EQ(carbon.epsilon_kj_per_mol, 0.276144);
  EXPECT_DOUBLE_EQ(force_field.type("opls_111").mass_u, 15.9994);
  EXPECT_THROW(force_field.type("opls_none"), docking::MoleculeError);
  for (const auto& [name, block] : force_field.blocks) {
    for (const BlockAtom& atom : block.atoms) EXPECT_NO_THROW(force_field.type(atom.type)) << name << " " << atom.name;
  }
}

TEST(ForceFieldFiles, AMissingFolderIsNamedWithThePackageThatContainsIt) {
  try {
    load_force_field("/nowhere/oplsaa.ff");
    FAIL() << "a missing folder was loaded";
  } catch (const docking::MoleculeError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/oplsaa.ff"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("gromacs-data"), std::string::npos) << error.what();
  }
}

TEST_F(OplsLoader, Loads3al1WithoutAGuess) {
  TANDEM_NEEDS_FILES(test::k3al1File);
  for (const std::string chain : {"A", "B"}) {
    const docking::Molecule molecule = load_molecule(test::k3al1File, {{chain}}, test::kOplsDirectory);
    EXPECT_EQ(molecule.size(), 220U);
    EXPECT_TRUE(molecule.guessed.empty()) << molecule.guessed.begin()->second;
    // The net charge is that of 3 GLU, 3 LYS and the carboxylate of GLY 112 / 212.
    EXPECT_NEAR(total_charge(molecule), -1.0, 1e-9);
    EXPECT_EQ(type_of(molecule, "ACE", "1H"), "opls_140");
    EXPECT_EQ(type_of(molecule, "GLY", "OXT"), "opls_272");
    EXPECT_EQ(std::count(molecule.types.begin(), molecule.types.end(), "opls_290"), 9) << "hydrogens on NZ";
    EXPECT_THAT(molecule.notes, testing::ElementsAre("net charge -1 e", testing::HasSubstr("alternate locations")));
  }
}

TEST_F(OplsLoader, NamesTheLigandOf1hpvThatItLeavesOut) {
  const std::filesystem::path file = "/usr/share/pymol/data/tut/1hpv.pdb";
  TANDEM_NEEDS_FILES(file);
  const docking::Molecule molecule = load_molecule(file, {}, test::kOplsDirectory);
  EXPECT_EQ(molecule.size(), 1516U) << "the protein";
  ASSERT_FALSE(molecule.notes.empty());
  EXPECT_EQ(molecule.notes[0],
            "left out, no amino acids of oplsaa: 1 residue 478 (35 atoms), 80 residues HOH (80 atoms)");
}

TEST(Disulfides, AreNotLookedForAmongMoreCysteinesThanAnyStructureHas) {
  PdbAtom sulfur;
  sulfur.name = "SG";
  sulfur.element = "S";
  PdbResidue cysteine{"CYS", "1", "A", 0, {sulfur}};
  std::vector<PdbResidue> residues(20'000, cysteine);
  for (std::size_t i = 0; i < residues.size(); ++i)
    residues[i].atoms[0].position_angstrom.x() = 9.0 * static_cast<double>(i);
  EXPECT_EQ(find_disulfides(residues).size(), residues.size());
  residues.push_back(cysteine);
  EXPECT_THROW(find_disulfides(residues), docking::MoleculeError);
}

TEST_F(OplsLoader, CountsGuessesByResidueAndNamesTheFirst) {
  const docking::Molecule molecule = load(test::residue_text("HIS", "N CA C O CB CG ND1 CD2 CE1 NE2", 1) +
                                          test::residue_text("ALA", "N CA C O X1", 2));
  const auto guess_note = std::find_if(molecule.notes.begin(), molecule.notes.end(), [](const std::string& note) {
    return note.starts_with("7 atoms without an exact entry in oplsaa guessed (ALA 1, HIS 6), the first: atom N of ");
  });
  EXPECT_NE(guess_note, molecule.notes.end()) << testing::PrintToString(molecule.notes);
}

TEST_F(OplsLoader, NotesAreFewShortAndPrintableForAnyResidueNames) {
  std::string text = test::residue_text("ALA", "N CA C O", 1);
  for (int i = 0; i < 300; ++i) text += test::residue_text("\x1b" + std::to_string(100 + i), "C1", 2 + i);
  const docking::Molecule molecule = load(text);
  ASSERT_LT(molecule.notes.size(), 8U);
  EXPECT_NE(molecule.notes[0].find(" and 292 more"), std::string::npos) << molecule.notes[0];
  for (const std::string& note : molecule.notes) {
    EXPECT_LT(note.size(), 400U);
    EXPECT_TRUE(std::all_of(note.begin(), note.end(), [](char c) { return c >= ' ' && c <= '~'; })) << note;
  }
}

TEST_F(OplsLoader, SurvivesDamagedStructures) {
  const std::string valid = kAcetyl + test::residue_text("HIS", kResidues[13].atoms, 5) +
                            test::residue_text("LYS", kResidues[19].atoms, 6) + kAmide;
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    std::string text = valid;
    // Only names and residues are damaged, so that most files pass the reader and reach the typing.
    for (unsigned i = 0; i <= seed % 40; ++i)
      text[random() % (text.size() / 67) * 67 + 12 + random() % 10] = static_cast<char>(random());
    try {
      const docking::Molecule molecule = load(text);
      EXPECT_EQ(molecule.types.size(), molecule.size()) << "seed " << seed;
    } catch (const docking::MoleculeError& error) {
      EXPECT_FALSE(std::string(error.what()).empty());
    }
  }
}

}  // namespace
}  // namespace tandem::server
