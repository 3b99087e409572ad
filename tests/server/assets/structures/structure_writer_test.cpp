// Tests that a complex is the same after it is written and read again, in both formats. Data that the PDB format cannot
// represent must be refused, not truncated.
#include "server/assets/structures/structure_writer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecule_asset.hpp"
#include "server/assets/structures/loader.hpp"
#include "server/assets/structures/readers/mmcif_reader.hpp"
#include "server/assets/structures/readers/pdb_reader.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

namespace fs = std::filesystem;
using docking::Molecule;

/// Half of the last decimal place in each format [Å].
constexpr double kPdbRounding = 0.5e-3, kMmcifRounding = 0.5e-6;

void add_atom(Molecule& molecule, const std::string& name, const std::string& element, const std::string& residue,
              const std::string& id, const std::string& chain, const Vec3& position, int segment = 0) {
  molecule.positions_angstrom.push_back(position);
  molecule.sigma_angstrom.push_back(3);
  molecule.epsilon_kj_per_mol.push_back(0.5);
  molecule.charge_e.push_back(0);
  molecule.mass_u.push_back(12);
  molecule.atom_names.push_back(name);
  molecule.elements.push_back(element);
  molecule.residue_names.push_back(residue);
  molecule.residue_ids.push_back(id);
  molecule.chains.push_back(chain);
  molecule.segments.push_back(segment);
  molecule.types.emplace_back("opls_135");
}

Molecule one_residue(const std::string& id, const std::string& chain, const Vec3& position = Vec3::Zero()) {
  Molecule molecule;
  add_atom(molecule, "CA", "C", "GLY", id, chain, position);
  return molecule;
}

Molecule many_atoms(std::size_t count) {
  Molecule molecule;
  for (std::size_t i = 0; i < count; ++i) {
    add_atom(molecule, "C" + std::to_string(i % 10), "C", "LIG", std::to_string(i / 10 % 10'000),
             std::string(1, static_cast<char>('A' + i / 100'000)), Vec3(0.001 * static_cast<double>(i % 1000), 0, 0));
  }
  return molecule;
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

std::string pdb_message(const Molecule& receptor, const Molecule& ligand = one_residue("1", "B")) {
  return message_of([&] { complex_pdb(receptor, ligand, Pose{}); });
}

void expect_atoms(const PdbStructure& read, const std::vector<const Molecule*>& molecules, double tolerance) {
  std::vector<std::pair<const PdbResidue*, const PdbAtom*>> atoms;
  for (const PdbResidue& residue : read.residues) {
    for (const PdbAtom& atom : residue.atoms) atoms.emplace_back(&residue, &atom);
  }
  std::size_t n = 0;
  for (const Molecule* molecule : molecules) {
    for (std::size_t i = 0; i < molecule->size(); ++i, ++n) {
      ASSERT_LT(n, atoms.size());
      const auto& [residue, atom] = atoms[n];
      EXPECT_EQ(atom->name, molecule->atom_names[i]);
      EXPECT_EQ(atom->element, molecule->elements[i]) << atom->name;
      EXPECT_EQ(residue->name, molecule->residue_names[i]);
      EXPECT_EQ(residue->id, molecule->residue_ids[i]);
      EXPECT_LE((atom->position_angstrom - molecule->positions_angstrom[i]).cwiseAbs().maxCoeff(), tolerance);
    }
  }
  EXPECT_EQ(n, atoms.size());
  EXPECT_EQ(read.duplicate_atoms + read.alternate_atoms, 0U);
}

/// Writes a temporary file and returns its path. The caller removes it.
fs::path written(const std::string& text, const std::string& ending) {
  const fs::path file = fs::path(testing::TempDir()) / ("tandem_writer_" + std::to_string(getpid()) + ending);
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

class RealComplex : public testing::Test {
 protected:
  void SetUp() override { TANDEM_NEEDS_FILES(test::kOplsDirectory, test::k3al1File); }

  static Molecule load(const fs::path& file, const std::string& chain, Hydrogens hydrogens = Hydrogens::kGiven) {
    return load_molecule(file, {{chain}}, test::kOplsDirectory, hydrogens);
  }

  /// Checks that a complex has the same energy after it is written and read back. To first order, rounded coordinates
  /// change the energy by the force times the rounding error. The bound is twice this product, because of the second
  /// order.
  static void expect_reads_back(const std::string& ending, Hydrogens hydrogens, const Pose& X_AB, double rounding) {
    const Molecule a = load(test::k3al1File, "A", hydrogens), b = load(test::k3al1File, "B", hydrogens);
    const fs::path file = written("", ending);
    save_complex(file, a, b, X_AB);
    const Molecule read_a = load(file, "A"), read_b = load(file, "B");
    ASSERT_EQ(read_a.size(), a.size());
    ASSERT_EQ(read_b.size(), b.size());
    EXPECT_EQ(read_a.atom_names, a.atom_names);
    EXPECT_EQ(read_b.residue_ids, b.residue_ids);
    EXPECT_EQ(read_a.types, a.types);
    EXPECT_EQ(read_b.charge_e, b.charge_e);
    for (std::size_t i = 0; i < b.size(); ++i) {
      const Vec3 error = read_b.positions_angstrom[i] - X_AB * b.positions_angstrom[i];
      EXPECT_LE(error.cwiseAbs().maxCoeff(), 1.001 * rounding);
    }
    docking::FieldModel model;
    model.dielectric = docking::Dielectric::kDistance;
    std::vector<Vec3> on_a, on_b;
    const docking::FieldResult before = docking::exact_field(a, b, X_AB, model, {&on_a, &on_b});
    const docking::FieldResult after = docking::exact_field(read_a, read_b, Pose{}, model);
    double bound = 0;
    for (const Vec3& force : on_a) bound += 2 * rounding * force.lpNorm<1>();
    for (const Vec3& force : on_b) bound += 2 * rounding * force.lpNorm<1>();
    EXPECT_NEAR(after.energy_kj_per_mol(), before.energy_kj_per_mol(), bound) << ending;
    EXPECT_NE(before.energy_kj_per_mol(), 0);
    fs::remove(file);
  }
};

TEST_F(RealComplex, IsReadWithItsAtomsAndItsEnergyForAnyPose) {
  const Pose moved{Vec3(1.25, -0.5, 2.0004567), quaternion_of(Vec3(0.05, -0.02, 0.03))};
  for (const Hydrogens hydrogens : {Hydrogens::kGiven, Hydrogens::kBuild}) {
    for (const Pose& X_AB : {Pose{}, moved}) {
      expect_reads_back(".pdb", hydrogens, X_AB, kPdbRounding);
      expect_reads_back(".cif", hydrogens, X_AB, kMmcifRounding);
    }
  }
}

TEST_F(RealComplex, LiesOverTheReceptorsFile) {
  std::set<std::string> of_file;
  std::ifstream original(test::k3al1File);
  for (std::string line; std::getline(original, line);) {
    if (line.starts_with("ATOM") || line.starts_with("HETATM")) of_file.insert(line.substr(17, 37));
  }
  const Molecule a = load(test::k3al1File, "A"), b = load(test::k3al1File, "B");
  std::istringstream text(complex_pdb(a, b, Pose{Vec3(1, 2, 3), Quat::Identity()}));
  std::size_t found = 0;
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with("ATOM") && !line.starts_with("HETATM")) continue;
    if (line[21] == 'A') found += of_file.contains(line.substr(17, 37)) ? 1U : 0U;
  }
  EXPECT_EQ(found, a.size());
}

TEST_F(RealComplex, GivesTheLigandsChainAFreeLetterAndReportsIt) {
  const Molecule a = load(test::k3al1File, "A");
  const Pose aside{Vec3(40, 0, 0), Quat::Identity()};
  const std::array<std::string, 2> texts = {complex_pdb(a, a, aside), complex_mmcif(a, a, aside)};
  const std::array<std::string, 2> endings = {".pdb", ".cif"};
  for (std::size_t n = 0; n < texts.size(); ++n) {
    EXPECT_NE(texts[n].find("chains of the ligand: B\n"), std::string::npos);
    EXPECT_NE(texts[n].find("chain B is chain A in its own file"), std::string::npos);
    EXPECT_NE(texts[n].find(" t 40.000000000 0.000000000 0.000000000"), std::string::npos);
    const fs::path file = written(texts[n], endings[n]);
    EXPECT_EQ(load(file, "A").types, a.types);
    EXPECT_EQ(load(file, "B").types, a.types);
    fs::remove(file);
  }
}

Molecule odd_names() {
  Molecule molecule;
  add_atom(molecule, "N", "N", "GLY", "-5", "A", {-999.999, 0, 9999.999});
  add_atom(molecule, "CA", "C", "GLY", "-5", "A", {-0.0001, 1.0005, 1});
  add_atom(molecule, "C", "C", "GLY", "-5", "A", {1, 2, 3});
  add_atom(molecule, "CA", "C", "GLY", "52", "A", {2, 2, 3});
  add_atom(molecule, "CA", "C", "GLY", "52A", "A", {3, 2, 3});
  add_atom(molecule, "O5'", "O", "DA", "52B", "A", {4, 2, 3});
  add_atom(molecule, "H5''", "H", "DA", "52B", "A", {5, 2, 3});
  add_atom(molecule, "'X #", "X", "LIG", "9999", "A", {6, 2, 3}, 1);
  add_atom(molecule, "_H", "H", "LIG", "9999", "A", {7, 2, 3}, 1);
  add_atom(molecule, "ZN", "ZN", "ZN", "A000", "b", {8, 2, 3});
  add_atom(molecule, "CA", "CA", "CA", "1", "b", {9, 2, 3});
  add_atom(molecule, "1HG2", "H", "ACEX", "2", "", {10, 2, 3});
  add_atom(molecule, "DATA", "D", "data", "3", "", {10, 2, 3});
  molecule.elements.back() = "H";
  return molecule;
}

TEST(ComplexWriter, KeepsEveryNameNumberAndInsertionCode) {
  const Molecule a = odd_names(), b = one_residue("7", "b", {-1.0625, 0, 0});
  expect_atoms(parse_pdb(complex_pdb(a, b, Pose{}), "x.pdb"), {&a, &b}, 0.0006);
  const std::string text = complex_mmcif(a, b, Pose{});
  expect_atoms(parse_mmcif(text, "x.cif"), {&a, &b}, 1e-6);
  EXPECT_EQ(text.find("-0.000 "), std::string::npos);
}

TEST(ComplexWriter, EndsEachChainAndNamesThoseWithoutAName) {
  const Molecule a = odd_names(), b = one_residue("7", "b");
  const std::string text = complex_pdb(a, b, Pose{});
  std::istringstream lines(text);
  std::string chains;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 80U) << line;
    if (line.starts_with("TER")) chains += line.substr(21, 1);
  }
  EXPECT_EQ(chains, "AAbBC");
  EXPECT_NE(text.find("chains of the receptor: B, A, b\n"), std::string::npos) << text;
  EXPECT_NE(text.find("chain B is without a name in its own file"), std::string::npos);
  EXPECT_NE(text.find("chain C is chain b in its own file"), std::string::npos);
  const auto pdb = parse_pdb(text, "x.pdb"), cif = parse_mmcif(complex_mmcif(a, b, Pose{}), "x.cif");
  ASSERT_EQ(pdb.residues.size(), cif.residues.size());
  for (std::size_t r = 0; r < pdb.residues.size(); ++r) {
    EXPECT_EQ(pdb.residues[r].chain, cif.residues[r].chain);
    EXPECT_EQ(pdb.residues[r].segment + 1, cif.residues[r].segment);
  }
}

TEST(ComplexWriter, DistinguishesAminoAcidsAndNucleotidesFromOtherResidues) {
  const std::string text = complex_pdb(odd_names(), one_residue("7", "b"), Pose{});
  EXPECT_NE(text.find("ATOM      1  N   GLY A  -5 "), std::string::npos);
  EXPECT_NE(text.find("ATOM      6  O5'  DA A  52B"), std::string::npos);
  EXPECT_NE(text.find("HETATM"), std::string::npos);
  EXPECT_NE(text.find("ZN    ZN bA000 "), std::string::npos) << text;
  EXPECT_NE(text.find("CA    CA b   1 "), std::string::npos);
}

TEST(ComplexWriter, UsesMmcifForContentThatPdbCannotHold) {
  const auto named = [](const std::string& name, const std::string& residue) {
    Molecule molecule;
    add_atom(molecule, name, "C", residue, "1", "A", Vec3::Zero());
    return molecule;
  };
  const double kBeyond = 9999.9996, kBelow = -999.9996;
  for (const Molecule& molecule :
       {one_residue("10000", "A"), one_residue("-1000", "A"), one_residue("12AB", "A"), one_residue("1", "AA"),
        one_residue("1", "A", {kBeyond, 0, 0}), one_residue("1", "A", {0, kBelow, 0}), named("CALPH", "GLY"),
        named("CA", "LIGND")}) {
    const std::string message = pdb_message(molecule);
    EXPECT_NE(message.find("PDB has"), std::string::npos) << message;
    EXPECT_NE(message.find("write mmCIF (FILE.cif) instead"), std::string::npos) << message;
    const Molecule ligand = one_residue("1", "B");
    expect_atoms(parse_mmcif(complex_mmcif(molecule, ligand, Pose{}), "x.cif"), {&molecule, &ligand}, 1e-6);
  }
  EXPECT_EQ(pdb_message(one_residue("1", "A", {9999.9994, -999.9994, 0})), "");
  // The range is checked for the coordinates after the pose is applied.
  EXPECT_NE(message_of([] {
              complex_pdb(one_residue("1", "A"), one_residue("1", "B"), Pose{Vec3(1e4, 0, 0), Quat::Identity()});
            }).find("not 10000.0"),
            std::string::npos);
}

TEST(ComplexWriter, HoldsTheLargestPdbAndRefusesTheNextAtom) {
  // The PDB format has serial numbers of five digits for atoms and chain ends together. The largest complex therefore
  // has 99,999 of both.
  Molecule receptor = many_atoms(99'996);
  EXPECT_EQ(pdb_message(receptor), "");
  add_atom(receptor, "C", "C", "LIG", "9999", "A", Vec3::Zero());
  EXPECT_NE(pdb_message(receptor).find("99999"), std::string::npos);
  const Molecule large = many_atoms(150'000);
  EXPECT_NE(pdb_message(large).find("write mmCIF"), std::string::npos);
  const PdbStructure read = parse_mmcif(complex_mmcif(large, one_residue("1", "A"), Pose{}), "x.cif");
  EXPECT_EQ(read.residues.size(), 15'001U);
  EXPECT_EQ(read.residues.back().chain, "C");
}

TEST(ComplexWriter, NamesAsManyChainsAsPdbHasLettersAndMoreInMmcif) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz012345678";
  Molecule receptor;
  for (const char letter : letters) add_atom(receptor, "CA", "C", "GLY", "1", {letter}, Vec3(letter, 0, 0));
  const Molecule ligand = one_residue("1", "A", {0, 5, 0});
  EXPECT_EQ(parse_pdb(complex_pdb(receptor, ligand, Pose{}), "x.pdb").residues.back().chain, "9");
  add_atom(receptor, "CA", "C", "GLY", "1", "9", Vec3(200, 0, 0));
  EXPECT_NE(pdb_message(receptor, ligand).find("chain's name AA; write mmCIF"), std::string::npos);
  EXPECT_EQ(parse_mmcif(complex_mmcif(receptor, ligand, Pose{}), "x.cif").residues.back().chain, "AA");
}

TEST(ComplexWriter, RefusesContentThatNeitherFormatCanHold) {
  const Molecule ligand = one_residue("1", "B");
  Molecule broken = one_residue("1", "A");
  broken.atom_names[0] = "C\nA";
  EXPECT_NE(pdb_message(broken).find("not printable ASCII"), std::string::npos);
  EXPECT_NE(message_of([&] { complex_mmcif(broken, ligand, Pose{}); }).find("not printable"), std::string::npos);
  broken.atom_names[0] = "'\"";
  EXPECT_NE(message_of([&] { complex_mmcif(broken, ligand, Pose{}); }).find("both kinds"), std::string::npos);
  const Pose nowhere{Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0), Quat::Identity()};
  EXPECT_THROW(complex_pdb(ligand, ligand, nowhere), std::invalid_argument);
  Molecule nameless = one_residue("1", "A");
  nameless.atom_names.clear();
  EXPECT_NE(pdb_message(nameless).find("read it from its file"), std::string::npos);
}

TEST(ComplexWriter, MakesRemarksPrintableAndNarrow) {
  const std::vector<std::string> remarks = {"5 Å\nATOM      1  N   GLY A  -5 ", std::string(200, 'x'),
                                            "words " + std::string(60, 'y') + " and more words"};
  const Molecule a = one_residue("1", "A"), b = one_residue("1", "B");
  std::istringstream lines(complex_pdb(a, b, Pose{}, remarks));
  std::size_t atoms = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 80U);
    EXPECT_TRUE(std::all_of(line.begin(), line.end(), [](char c) { return c >= ' ' && c <= '~'; })) << line;
    atoms += line.starts_with("ATOM") || line.starts_with("HETATM") ? 1U : 0U;
  }
  EXPECT_EQ(atoms, 2U);
  const std::string cif = complex_mmcif(a, b, Pose{}, remarks);
  EXPECT_NE(cif.find("# 5 ???ATOM"), std::string::npos);
  expect_atoms(parse_mmcif(cif, "x.cif"), {&a, &b}, 0);
}

TEST(ComplexWriter, WritesTheEnergiesAndTheModel) {
  docking::FieldResult result;
  result.lennard_jones_kj_per_mol = -12.5;
  result.coulomb_kj_per_mol = 2.25;
  docking::FieldModel model;
  EXPECT_EQ(energy_remarks(result, model).back(), "no charges, no cut-off");
  model.dielectric = docking::Dielectric::kDistance;
  model.cutoff_angstrom = 8;
  EXPECT_EQ(energy_remarks(result, model),
            (std::vector<std::string>{"Lennard-Jones -12.500000, Coulomb 2.250000, total -10.250000 kJ/mol",
                                      "dielectric 4r, cut-off 8 angstrom"}));
}

TEST(ComplexWriter, ReplacesTheFileWholeOrLeavesIt) {
  const Molecule a = one_residue("1", "A"), b = one_residue("1", "B");
  const fs::path file = written("of before", "_kept.pdb");
  EXPECT_THROW(save_complex(file, one_residue("10000", "A"), b, Pose{}), docking::MoleculeError);
  std::ifstream kept(file);
  std::string text;
  std::getline(kept, text);
  EXPECT_EQ(text, "of before");
  save_complex(file, a, b, Pose{});
  EXPECT_EQ(read_structure(file).residues.size(), 2U);
  fs::remove(file);
  const std::string message = message_of([&] { save_complex(fs::path("/proc/none/x.cif"), a, b, Pose{}); });
  EXPECT_NE(message.find("/proc/none/x.cif: cannot be written"), std::string::npos) << message;
  for (const char* const name : {"complex", "complex.mol2", "complex.pdb.gz"}) {
    EXPECT_NE(message_of([name] { check_complex_name(name); }).find("in .pdb or .cif"), std::string::npos);
  }
}

}  // namespace
}  // namespace tandem::server
