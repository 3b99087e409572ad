// Tests structures in the forms that real programs write: atoms, elements, chains and charges must be recognised.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>
#include <string>

#include "server/assets/structures/chain_links.hpp"
#include "server/assets/structures/elements.hpp"
#include "server/assets/structures/histidines.hpp"
#include "server/assets/structures/loader.hpp"
#include "server/assets/structures/readers/mmcif_reader.hpp"
#include "server/assets/structures/readers/pdb_reader.hpp"
#include "server/assets/structures/readers/pqr_reader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

using test::residue_text;
using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;

std::string joined_notes(const docking::Molecule& molecule) {
  std::string all;
  for (const std::string& note : molecule.notes) all += note + "\n";
  return all;
}

double charge_of(const docking::Molecule& molecule) {
  return std::accumulate(molecule.charge_e.begin(), molecule.charge_e.end(), 0.0);
}

docking::Molecule load_text(const std::string& text, const std::string& force_field = test::kOplsDirectory.string(),
                            Hydrogens hydrogens = Hydrogens::kGiven, const StructureSelection& selection = {},
                            StructureReport* report = nullptr) {
  const test::PdbFile file(text);
  return load_molecule(file.path(), selection, force_field, hydrogens, report);
}

std::string hetero(const std::string& name, const std::string& residue, double x, int number = 1) {
  return test::to_text({.name = name, .residue = residue, .number = number, .x = x, .record = "HETATM"});
}

TEST(AtomIdentity, AtomsThatShareANameAreSeveralUnlessAtOnePlace) {
  std::string text;
  for (int i = 0; i < 9; ++i) text += hetero(" C  ", "AIN", 1.4 * i);
  for (int i = 0; i < 4; ++i) text += hetero(" O  ", "AIN", 1.4 * i + 0.7);
  text += hetero(" O  ", "AIN", 0.7);
  const PdbStructure structure = parse_pdb(text, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 1U);
  EXPECT_EQ(structure.residues[0].atoms.size(), 13U);
  EXPECT_EQ(structure.duplicate_atoms, 1U);
}

TEST(AtomIdentity, ASecondProtomerWithTheSameNumbersIsNotADuplicate) {
  const std::string one = residue_text("ALA", "N CA C O CB", 1, ' ') + residue_text("GLY", "N CA C O", 2, ' ');
  std::string two = one;
  for (std::size_t at = 30; at < two.size(); at += two.find('\n', at) + 1 - at + 30) two.replace(at, 8, "  80.000");
  const PdbStructure structure = parse_pdb(one + two, "x.pdb");
  EXPECT_EQ(structure.residues.size(), 4U);
  EXPECT_EQ(structure.duplicate_atoms, 0U);
}

TEST(AtomIdentity, SegmentsNameTheChainsOfAFileWithoutThem) {
  const auto with_segment = [](std::string line, const std::string& segment) {
    line.pop_back();
    line.resize(72, ' ');
    return line + segment + "\n";
  };
  const std::string atom = test::to_text({.name = " CA ", .chain = ' '});
  const PdbStructure two = parse_pdb(with_segment(atom, "PROA") + with_segment(atom, "PROB"), "x.pdb");
  ASSERT_EQ(two.residues.size(), 2U);
  EXPECT_EQ(two.residues[1].chain, "PROB");
  // In old files, these columns contain the PDB code, which must not become a segment name.
  const PdbStructure one = parse_pdb(with_segment(atom, "1ABC"), "x.pdb");
  EXPECT_EQ(one.residues[0].chain, "");
}

TEST(Alternates, BondedNeighboursUseTheSameAlternate) {
  std::string text;
  // Residue 1 slightly prefers location A, and residue 2 strongly prefers location B. Both residues must get location
  // B, because they are bonded to each other.
  const auto add = [&text](const char* name, int number, char letter, double occupancy, double x) {
    text += test::to_text({.name = name, .number = number, .alternate = letter, .x = x, .occupancy = occupancy});
  };
  add(" C  ", 1, 'A', 0.55, 0);
  add(" C  ", 1, 'B', 0.45, 1);
  add(" N  ", 2, 'A', 0.2, 2);
  add(" N  ", 2, 'B', 0.8, 3);
  const PdbStructure structure = parse_pdb(text, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 2U);
  EXPECT_EQ(structure.residues[0].atoms.at(0).position_angstrom.x(), 1);
  EXPECT_EQ(structure.residues[1].atoms.at(0).position_angstrom.x(), 3);
}

TEST(Alternates, OfTwoResiduesAtOnePlaceTheLargerOccupancyIsTaken) {
  const std::string text = test::to_text({.name = " CA ", .residue = "SER", .alternate = 'A', .occupancy = 0.3}) +
                           test::to_text({.name = " CA ", .residue = "THR", .alternate = 'B', .occupancy = 0.7});
  const PdbStructure structure = parse_pdb(text, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 1U);
  EXPECT_EQ(structure.residues[0].name, "THR");
}

TEST(Alternates, AHistidineIsNeverProtonatedByBoth) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  std::string text = residue_text("HIS", "N H CA HA C O CB HB2 HB3 CG ND1 HD1 CD2 HD2 CE1 HE1 NE2 HE2", 1);
  const auto set = [&text](const std::string& atom, const std::string& letter, const std::string& occupancy) {
    const std::size_t at = text.find(" " + atom + " HIS");
    ASSERT_NE(at, std::string::npos);
    text.replace(at + 4, 1, letter);
    text.replace(at + 42, 6, occupancy);
  };
  set("HD1", "A", "  0.60");
  set("HE2", "B", "  0.40");
  const docking::Molecule molecule = load_text(text);
  EXPECT_THAT(molecule.atom_names, Contains("HD1"));
  EXPECT_THAT(molecule.atom_names, testing::Not(Contains("HE2")));
}

TEST(Elements, ComeFromTheFilesOwnColumnThenFromColumnsOfTheName) {
  const auto element = [](const char* name, const char* stated, const char* residue) {
    return element_of({name, stated, residue});
  };
  EXPECT_EQ(element("HG", "HG", "MBO"), "HG");
  EXPECT_EQ(element("PT1", "Pt", "CPT"), "PT");
  EXPECT_EQ(element("CA", "C", "LIG"), "C");
  EXPECT_EQ(element("CA", "", "CA"), "CA");
  EXPECT_EQ(element("CA", "", "CAP"), "C");
  EXPECT_EQ(element("ZN", "", "ZN2"), "ZN");
  EXPECT_EQ(element("CL1 ", "", "LIG"), "CL");
  EXPECT_EQ(element(" CL1", "", "LIG"), "C");
  EXPECT_EQ(element("CL1", "", "LIG"), "CL");
  EXPECT_EQ(element(" HG ", "", "SER"), "H");
  EXPECT_EQ(element("HG", "HG", "SER"), "H") << "an amino acid has no mercury";
  EXPECT_EQ(element("SE  ", "SE", "MSE"), "SE");
  EXPECT_EQ(element("D", "D", "ALA"), "H");
  EXPECT_EQ(element("1HB ", "", "ALA"), "H");
  EXPECT_EQ(element("XQ1", "", "LIG"), "X");
}

TEST(Elements, AllHaveASizeThatNoneTakesForAnother) {
  for (const ChemicalElement& element : periodic_table()) {
    EXPECT_GT(element.sigma_angstrom(), 2.0) << element.symbol;
    EXPECT_GT(element.well_kcal_per_mol, 0) << element.symbol;
    EXPECT_EQ(find_element(element.symbol), &element);
  }
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  const docking::Molecule molecule = load_text(
      residue_text("GLY", "N CA C O", 1) + test::to_text({.name = "HG  ", .residue = "HG", .number = 7, .x = 50}),
      test::kOplsDirectory.string(), Hydrogens::kGiven, {{"A", "A/HG"}});
  EXPECT_EQ(molecule.types.back(), "element HG");
  EXPECT_THAT(joined_notes(molecule), HasSubstr("charges that are lost"));
  EXPECT_THAT(joined_notes(molecule), HasSubstr("HG 7 of chain A (+2 e)"));
}

TEST(ChainLinks, AreBondsNotLettersOfChains) {
  const std::string text = residue_text("ALA", "N CA C O", 1, 'A') + residue_text("ALA", "N CA C O", 2, 'B') + "TER\n" +
                           residue_text("ALA", "N CA C O", 3, 'C') + residue_text("ALA", "N CA C O", 7, 'C');
  const std::vector<ChainLink> links = chain_links(parse_pdb(text, "x.pdb").residues);
  ASSERT_EQ(links.size(), 4U);
  EXPECT_EQ(links[0].begins, ChainEnd::kEnd);
  EXPECT_EQ(links[1].previous, std::optional<std::size_t>(0));
  EXPECT_EQ(links[2].previous, std::optional<std::size_t>(1)) << "across TER and a letter";
  EXPECT_EQ(links[2].ends, ChainEnd::kGap);
  EXPECT_EQ(links[3].begins, ChainEnd::kGap);
  EXPECT_EQ(links[3].ends, ChainEnd::kEnd);
}

TEST(ChainLinks, ARecordThatEndsAChainWithinItsNumbersIsAGap) {
  const auto begin_of = [](int next) {
    const std::string text =
        residue_text("ALA", "N CA C O", 5) + "TER\n" + residue_text("ALA", "N CA C O", next) + "END\n";
    return chain_links(parse_pdb(text, "x.pdb").residues).at(1).begins;
  };
  EXPECT_EQ(begin_of(9), ChainEnd::kGap);
  EXPECT_EQ(begin_of(1), ChainEnd::kEnd) << "another molecule with the same chain letter";
}

TEST(ChainLinks, AreBoundedHoweverManyAtomsAreAtOnePlace) {
  const std::vector<PdbResidue> residues = [] {
    PdbResidue one = parse_pdb(residue_text("ALA", "N CA C O", 1), "x.pdb").residues.at(0);
    for (PdbAtom& atom : one.atoms) atom.position_angstrom.setZero();
    return std::vector<PdbResidue>(20'000, one);
  }();
  EXPECT_EQ(chain_links(residues).size(), residues.size());
}

TEST(ChainEnds, EndsOfGapsAreNeutralAndEndsOfChainsWholeIons) {
  for (const char* const force_field : {"oplsaa", "amber99sb", "charmm27"}) {
    const std::filesystem::path folder = test::kOplsDirectory.parent_path() / (std::string(force_field) + ".ff");
    const std::filesystem::path ubiquitin = "/usr/share/freesasa/test-data/1ubq.pdb";
    TANDEM_NEEDS_FILES(folder, ubiquitin);
    std::ifstream file(ubiquitin);
    std::string text;
    for (std::string line; std::getline(file, line);) {
      if (!line.starts_with("ATOM")) continue;
      const int number = std::stoi(line.substr(22, 4));
      const bool is_left_out = (number > 20 && number < 25) || number > 70;
      if (!is_left_out) text += line + "\n";
    }
    StructureReport report;
    const docking::Molecule molecule = load_text(text, folder.string(), Hydrogens::kBuild, {}, &report);
    EXPECT_NEAR(charge_of(molecule), std::round(charge_of(molecule)), 1e-3) << force_field;
    EXPECT_TRUE(report.charge.is_whole()) << force_field;
    EXPECT_TRUE(report.missing.empty()) << force_field << ": " << report.missing.front();
    EXPECT_THAT(report.gaps, testing::ElementsAre("before ASN 25 of chain A")) << force_field;
    EXPECT_THAT(report.built, testing::ElementsAre("atom OXT of VAL 70 of chain A"));
  }
}

TEST(ChainEnds, ASideChainThatTheFileHasInPartHasAWholeCharge) {
  const std::filesystem::path ubiquitin = "/usr/share/freesasa/test-data/1ubq.pdb";
  TANDEM_NEEDS_FILES(test::kOplsDirectory, ubiquitin);
  const std::set<std::string> left_out = {" CD  16", " OE1  16", " OE2  16", " CG  33",  " CD  33", " CE  33",
                                          " NZ  33", " CB  39",  " CG  39",  " OD1  39", " OD2  39"};
  std::ifstream file(ubiquitin);
  std::string text;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("ATOM")) continue;
    std::string name = line.substr(12, 4);
    while (name.back() == ' ') name.pop_back();
    if (!left_out.contains(name + line.substr(22, 4))) text += line + "\n";
  }
  StructureReport report;
  const docking::Molecule molecule = load_text(text, test::kOplsDirectory.string(), Hydrogens::kBuild, {}, &report);
  EXPECT_TRUE(report.charge.is_whole()) << charge_of(molecule);
  EXPECT_TRUE(report.charge.suspects.empty()) << report.charge.suspects.front();
  EXPECT_THAT(joined_notes(molecule), HasSubstr("GLU 16 of chain A (-1 e, incomplete)"));
  EXPECT_THAT(joined_notes(molecule), HasSubstr("LYS 33 of chain A (+1 e, incomplete)"));
}

TEST(Hydrogens, MisplacedOnesAreRemovedAndBuiltAnew) {
  const std::filesystem::path ubiquitin = "/usr/share/freesasa/test-data/1ubq.pdb";
  TANDEM_NEEDS_FILES(test::kOplsDirectory, ubiquitin);
  const docking::Molecule built = load_molecule(ubiquitin, {}, test::kOplsDirectory, Hydrogens::kBuild);
  std::string text;
  for (std::size_t i = 0; i < built.size(); ++i) {
    const std::string& name = built.atom_names[i];
    const bool is_moved = built.residue_ids[i] == "30" && name == "HB";
    text += test::to_text({.name = name.size() < 4 ? " " + name : name,
                           .residue = built.residue_names[i],
                           .number = std::stoi(built.residue_ids[i]),
                           .x = built.positions_angstrom[i].x() + (is_moved ? 4 : 0),
                           .y = built.positions_angstrom[i].y(),
                           .z = built.positions_angstrom[i].z()});
  }
  StructureReport report;
  const docking::Molecule read = load_text(text, test::kOplsDirectory.string(), Hydrogens::kGiven, {}, &report);
  EXPECT_EQ(read.size(), built.size());
  EXPECT_TRUE(read.guessed.empty());
  EXPECT_TRUE(report.charge.is_whole());
  EXPECT_THAT(report.dropped, Contains(StartsWith("hydrogen HB of ILE 30 of chain A: on no atom")));
  EXPECT_THAT(joined_notes(read), HasSubstr("built in 1 residue: ILE 30 of chain A"));
}

TEST(Histidines, CarryTheirHydrogenWhereAnAcceptorIsNearAndNotWhereAMetalIs) {
  const auto ring = [](const std::string& near, double x, double y) {
    // Ring atoms of a histidine in the plane z = 0. The nitrogen ND1 is on the side of −x, the nitrogen NE2 on the side
    // of +x.
    std::string text;
    const auto add = [&text](const char* name, double ax, double ay) {
      text += test::to_text({.name = name, .residue = "HIS", .x = ax, .y = ay});
    };
    add(" CG ", -0.7, 1.1);
    add(" ND1", -1.1, -0.2);
    add(" CE1", 0, -1);
    add(" NE2", 1.1, -0.2);
    add(" CD2", 0.7, 1.1);
    const std::string name = near == "ZN" ? "ZN  " : " " + near;
    text += test::to_text({.name = name, .residue = near == "ZN" ? "ZN" : "ASP", .number = 9, .x = x, .y = y});
    const PdbStructure structure = parse_pdb(text, "x.pdb");
    return choose_histidines({structure.residues.at(0)}, {structure.residues.at(1)}).at(0);
  };
  EXPECT_EQ(ring("OD1", -3.8, -0.6).block, "HISD");
  EXPECT_THAT(ring("OD1", -3.8, -0.6).reason, HasSubstr("ND1 is 2.7 Å from OD1 of ASP 9"));
  EXPECT_EQ(ring("OD1", 3.8, -0.6).block, "HISE");
  EXPECT_EQ(ring("ZN", 3.1, -0.5).block, "HISD");
  EXPECT_EQ(ring("ZN", -3.1, -0.5).block, "HISE");
  EXPECT_EQ(ring("NZ ", 3.8, -0.6).block, "HISD");
  EXPECT_EQ(ring("OD1", 0, -20).block, "HISE");
}

TEST(Nucleotides, UseTheBlocksOfAForceFieldThatContainsThem) {
  const std::filesystem::path folder = test::kOplsDirectory.parent_path() / "amber99sb.ff";
  TANDEM_NEEDS_FILES(folder);
  const std::string sugar_and_adenine =
      "O5' C5' H5' H5'' C4' H4' O4' C1' H1' N9 C8 H8 N7 C5 C6 N6 H61 H62 N1 C2 H2 N3 C4 C3' H3' C2' H2' H2'' O3'";
  std::string first = sugar_and_adenine;
  first.insert(3, " HO5'");
  const std::string text = residue_text("DA", first, 1) + residue_text("DA", "P OP1 OP2 " + sugar_and_adenine, 2) +
                           residue_text("DA", "P OP1 OP2 " + sugar_and_adenine + " HO3'", 3);
  const docking::Molecule molecule = load_text(text, folder.string());
  EXPECT_TRUE(molecule.guessed.empty()) << molecule.guessed.begin()->second;
  EXPECT_NEAR(charge_of(molecule), -2, 1e-4);
  EXPECT_THAT(molecule.notes, testing::ElementsAre("net charge -2 e"));
}

TEST(Nucleotides, FromFilesBefore2007AreRecognised) {
  const std::filesystem::path folder = test::kOplsDirectory.parent_path() / "amber99sb.ff";
  TANDEM_NEEDS_FILES(folder);
  // The second nucleotide is a pyrimidine with an atom O2. O2 must not be mistaken for an oxygen at the end of a
  // protein chain.
  const auto chain = [](const std::string& phosphate, const std::string& methyl, const std::string& prefix) {
    const std::string sugar = "O5' C5' H5' H5'' C4' H4' O4' C1' H1' ", end = " C3' H3' C2' H2' H2'' O3'";
    std::string first = sugar + "N9 C8 H8 N7 C5 C6 N6 H61 H62 N1 C2 H2 N3 C4" + end;
    first.insert(3, " HO5'");
    return residue_text(prefix + "A", first, 1) +
           residue_text(prefix + "T",
                        phosphate + sugar + "N1 C6 H6 C5 " + methyl + " H71 H72 H73 C4 O4 N3 H3 C2 O2" + end + " HO3'",
                        2);
  };
  const docking::Molecule today = load_text(chain("P OP1 OP2 ", "C7", "D"), folder.string());
  std::string old_text = chain("P O1P O2P ", "C5M", "");
  for (std::size_t at = 0; (at = old_text.find('\'', at)) != std::string::npos;) {
    // Old files have asterisks in place of primes. Names of hydrogens with two primes are kept, because hydrogens are
    // recognised by the atoms to which they are bonded.
    if (old_text[at - 1] != '\'' && old_text[at + 1] != '\'') old_text[at] = '*';
    ++at;
  }
  const docking::Molecule before = load_text(old_text, folder.string());
  EXPECT_TRUE(today.guessed.empty()) << today.guessed.begin()->second;
  EXPECT_TRUE(before.guessed.empty()) << before.guessed.begin()->second;
  EXPECT_EQ(before.types, today.types);
  EXPECT_EQ(before.charge_e, today.charge_e);
  EXPECT_NEAR(charge_of(today), -1, 1e-4);
}

TEST(Ions, HaveTheChargesOfTheirBlocks) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  const std::string text = residue_text("GLY", "N CA C O", 1) +
                           test::to_text({.name = "NA  ", .residue = "NA", .number = 7, .x = 50}) +
                           test::to_text({.name = "CL  ", .residue = "CL", .number = 8, .x = 60});
  const docking::Molecule molecule =
      load_text(text, test::kOplsDirectory.string(), Hydrogens::kGiven, {{"A/NA", "A/CL"}});
  ASSERT_EQ(molecule.size(), 2U);
  EXPECT_EQ(molecule.charge_e[0], 1);
  EXPECT_EQ(molecule.charge_e[1], -1);
  EXPECT_TRUE(molecule.guessed.empty());
}

TEST(NetCharge, WaterWithoutHydrogensHasNone) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  const std::string text = residue_text("GLY", "N CA C O", 1) + residue_text("HOH", "O", 2);
  const docking::Molecule molecule = load_text(text, test::kOplsDirectory.string(), Hydrogens::kGiven, {{"/HOH"}});
  ASSERT_EQ(molecule.size(), 1U);
  EXPECT_EQ(molecule.charge_e[0], 0);
}

TEST(NetCharge, OfAPqrFileStaysWhereHydrogensAreBuilt) {
  const std::filesystem::path file = "/usr/share/apbs/examples/pbsam-barn_bars/barstar.pqr";
  TANDEM_NEEDS_FILES(test::kOplsDirectory, file);
  const docking::Molecule given = load_molecule(file, {}, test::kOplsDirectory, Hydrogens::kGiven);
  const docking::Molecule built = load_molecule(file, {}, test::kOplsDirectory, Hydrogens::kBuild);
  EXPECT_EQ(built.size(), given.size());
  EXPECT_NEAR(charge_of(built), charge_of(given), 1e-9);
}

TEST(NetCharge, AResidueThatIsNotWholeIsNamed) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  StructureReport report;
  const docking::Molecule molecule =
      load_text(residue_text("GLY", "N H CA HA2 HA3 C O", 1) +
                    residue_text("GLU", "N H CA HA C O CB HB2 HB3 CG HG2 CD OE1 OE2", 2) +
                    residue_text("GLY", "N H CA HA2 HA3 C O", 3),
                test::kOplsDirectory.string(), Hydrogens::kGiven, {}, &report);
  EXPECT_FALSE(report.charge.is_whole());
  EXPECT_NEAR(report.charge.total_e, -1.06, 1e-9);
  EXPECT_THAT(report.charge.suspects, testing::ElementsAre("GLU 2 of chain A: -1.06 of -1 e"));
  EXPECT_THAT(joined_notes(molecule), HasSubstr("not whole in chain A (-1.06 e)"));
}

TEST(Traces, AreRefused) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  std::string text;
  for (int i = 1; i < 9; ++i) text += residue_text("ALA", "CA", i);
  try {
    load_text(text);
    FAIL() << "eight alpha carbons were accepted as a protein";
  } catch (const docking::MoleculeError& error) {
    EXPECT_THAT(error.what(), HasSubstr("8 of 8 residues have only an alpha carbon"));
  }
}

TEST(PqrFiles, AreReadWithoutSpacesBetweenNumbers) {
  const PdbStructure structure = parse_pqr(
      "ATOM      1  N   GLY A 999      -0.036 -12.088 -13.641 -0.3000 1.8240\n"
      "ATOM      2  CA  GLY A1000      -7.229 -11.247 -12.562  0.1900 1.9080\n"
      "ATOM      3  C   GLY A1000    -107.229-111.247-112.562  0.1900 1.9080\n"
      "ATOM      4  O   GLY A1000       1.000   2.000   3.000 -0.12300623   1.550  O\n"
      "HETATM    5  ZN  ZN    12        4.000   5.000   6.000  2.0000 1.0900\n",
      "x.pqr");
  ASSERT_EQ(structure.residues.size(), 3U);
  EXPECT_EQ(structure.residues[1].chain, "A");
  EXPECT_EQ(structure.residues[1].id, "1000");
  ASSERT_EQ(structure.residues[1].atoms.size(), 3U);
  EXPECT_EQ(structure.residues[1].atoms[1].position_angstrom, Vec3(-107.229, -111.247, -112.562));
  EXPECT_EQ(structure.residues[1].atoms[2].charge_e, -0.12300623);
  EXPECT_EQ(structure.residues[1].atoms[2].radius_angstrom, 1.55);
  EXPECT_EQ(structure.residues[2].chain, "");
  EXPECT_EQ(structure.residues[2].atoms[0].element, "ZN");
}

TEST(PdbqtFiles, HaveTheChargesAndElementsOfAutoDock) {
  const std::string line =
      "ATOM      1  OE1 LIG B   1       0.236  17.885   9.478  0.00  0.00    -0.347 OA\n"
      "ATOM      2  HO1 LIG B   1       1.236  17.885   9.478  0.00  0.00    +0.210 HD\n"
      "ATOM      3  C7  LIG B   1       2.236  17.885   9.478  0.00  0.00    +0.010 A \n"
      "ATOM      4 CL1  LIG B   1       3.236  17.885   9.478  0.00  0.00    -0.010 Cl\n";
  const PdbStructure structure = parse_pdb("ROOT\n" + line + "ENDROOT\nTORSDOF 1\n", "x.pdbqt", PdbFlavour::kPdbqt);
  ASSERT_EQ(structure.residues.size(), 1U);
  const std::vector<PdbAtom>& atoms = structure.residues[0].atoms;
  ASSERT_EQ(atoms.size(), 4U);
  EXPECT_EQ(atoms[0].element, "O");
  EXPECT_EQ(atoms[0].charge_e, -0.347);
  EXPECT_EQ(atoms[1].element, "H");
  EXPECT_EQ(atoms[2].element, "C");
  EXPECT_EQ(atoms[3].element, "CL");
  EXPECT_THROW(parse_pdb(line.substr(0, 60) + "\n", "x.pdbqt", PdbFlavour::kPdbqt), docking::MoleculeError);
}

TEST(MmcifFiles, HaveKeywordsInAnyLetters) {
  const PdbStructure structure = parse_mmcif(
      "DATA_x\nLOOP_\n_ATOM_SITE.ID\n_Atom_Site.Type_Symbol\n_atom_site.LABEL_ATOM_ID\n_atom_site.label_comp_id\n"
      "_atom_site.label_asym_id\n_atom_site.label_seq_id\n_atom_site.Cartn_x\n_atom_site.cartn_y\n_atom_site.CARTN_Z\n"
      "1 N N GLY A 1 1 2 3\n",
      "x.cif");
  ASSERT_EQ(structure.residues.size(), 1U);
  EXPECT_EQ(structure.residues[0].atoms.at(0).position_angstrom, Vec3(1, 2, 3));
}

}  // namespace
}  // namespace tandem::server
