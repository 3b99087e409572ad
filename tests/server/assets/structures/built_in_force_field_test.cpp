// Tests the force-field parameters by element, which are used on machines without the package gromacs-data.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <utility>

#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/loader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

std::string notes_of(const docking::Molecule& molecule) {
  std::string all;
  for (const std::string& note : molecule.notes) all += note + "\n";
  return all;
}

TEST(BuiltInForceField, IsTheDefaultIfThePackageIsMissing) {
  EXPECT_EQ(default_force_field("/nowhere/oplsaa.ff"), "built-in");
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  EXPECT_EQ(default_force_field(folder), folder.string());
  EXPECT_THROW(load_force_field("/nowhere/oplsaa.ff"), docking::MoleculeError)
      << "a folder that was named stays an error";
  EXPECT_EQ(load_force_field("built-in").name, "built-in");
}

TEST(BuiltInForceField, TypesAminoAcidsCapsAndLigandsByElementWithoutCharges) {
  // test::residue_text places each hydrogen beside the atom that precedes it in the list, so that the hydrogen counts
  // as bonded to this atom.
  const test::PdbFile file(test::residue_text("ACE", "C O CH3", 1) + test::residue_text("CYS", "N H CA C O SG", 2) +
                           test::residue_text("HIE", "N CA HA C O", 3) + test::residue_text("ZN", "ZN", 4) +
                           test::residue_text("LIG", "C1 XX", 5));
  const docking::Molecule molecule = load_molecule(file.path(), {{"A", "A/LIG"}}, kBuiltInForceField);
  ASSERT_EQ(molecule.size(), 16U) << "not the zinc, which was not chosen";
  EXPECT_EQ(molecule.force_field, "built-in");
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    EXPECT_EQ(molecule.charge_e[i], 0);
    const std::string& element = molecule.elements[i];
    const bool is_known = element == "C" || element == "N" || element == "O" || element == "S" || element == "H";
    EXPECT_EQ(molecule.guessed.contains(i), !is_known) << molecule.atom_names[i];
    if (element == "S") {
      EXPECT_DOUBLE_EQ(molecule.sigma_angstrom[i], 3.55);
      EXPECT_DOUBLE_EQ(molecule.epsilon_kj_per_mol[i], 0.25 * 4.184);
    }
    if (element == "H") {
      EXPECT_EQ(molecule.sigma_angstrom[i], molecule.atom_names[i] == "HA" ? 2.5 : 0) << "on carbon, and on nitrogen";
    }
  }
  const std::string notes = notes_of(molecule);
  EXPECT_NE(notes.find("built-in parameters by element, no charges; "), std::string::npos) << notes;
  EXPECT_NE(notes.find("1 residue ZN (1 atom)"), std::string::npos) << notes;
  const bool is_installed = std::filesystem::exists(kOplsDirectory);
  EXPECT_NE(notes.find(built_in_note(is_installed, false) + "\n"), std::string::npos) << notes;
}

TEST(BuiltInForceField, ExplainsHowToSelectOplsAa) {
  EXPECT_EQ(
      built_in_note(false, false),
      "gromacs-data is not installed: built-in parameters by element, no charges; install gromacs-data for OPLS-AA");
  EXPECT_EQ(built_in_note(true, true),
            "built-in parameters by element, the file's charges; name " + std::string(kOplsDirectory) + " for OPLS-AA");
}

TEST(BuiltInForceField, ReportsMissingHydrogensAndBuildsNone) {
  const test::PdbFile file(test::residue_text("ALA", "N CA C O CB", 1));
  EXPECT_NE(notes_of(load_molecule(file.path(), {}, kBuiltInForceField)).find("attraction is too weak"),
            std::string::npos);
  for (const Hydrogens hydrogens : {Hydrogens::kBuild, Hydrogens::kUnited}) {
    try {
      load_molecule(file.path(), {}, kBuiltInForceField, hydrogens);
      FAIL() << "hydrogens were built without rules";
    } catch (const docking::MoleculeError& error) {
      EXPECT_NE(std::string(error.what()).find("gromacs-data"), std::string::npos) << error.what();
    }
  }
}

TEST(BuiltInForceField, HasTheStandInsOfOplsAa) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  const ForceField opls = load_force_field(test::kOplsDirectory), built_in = built_in_force_field();
  constexpr std::array<std::pair<const char*, const char*>, 12> kSame = {{{"C", "opls_135"},
                                                                          {"N", "opls_238"},
                                                                          {"O", "opls_236"},
                                                                          {"P", "opls_393"},
                                                                          {"H", "opls_140"},
                                                                          {"HP", "opls_241"},
                                                                          {"F", "opls_164"},
                                                                          {"CL", "opls_151"},
                                                                          {"BR", "opls_722"},
                                                                          {"NA", "opls_407"},
                                                                          {"MG", "opls_411"},
                                                                          {"CA", "opls_412"}}};
  for (const auto& [element, type] : kSame) {
    const AtomType &ours = built_in.type(element), &theirs = opls.type(type);
    EXPECT_NEAR(ours.sigma_angstrom, theirs.sigma_angstrom, 1e-3) << element;
    EXPECT_NEAR(ours.epsilon_kj_per_mol, theirs.epsilon_kj_per_mol, 1e-3 * theirs.epsilon_kj_per_mol + 1e-9) << element;
    EXPECT_NEAR(ours.mass_u, theirs.mass_u, 0.02) << element;
  }
}

}  // namespace
}  // namespace tandem::server
