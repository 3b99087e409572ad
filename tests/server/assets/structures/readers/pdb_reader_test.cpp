// Tests the PDB reader: files that it must accept, refusals that name the position and the remedy, and hostile input
// that must not crash it.
#include "server/assets/structures/readers/pdb_reader.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>

#include "server/assets/structures/structure_file.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/pdb_text.hpp"

namespace tandem::server {
namespace {

using test::PdbLine;
using test::residue_text;
using test::to_text;

std::string message_of(const std::string& text) {
  try {
    parse_pdb(text, "x.pdb");
  } catch (const docking::MoleculeError& error) {
    return error.what();
  }
  return "";
}

TEST(PdbReader, ReadsTheFixedColumns) {
  const std::string line = "ATOM   1234  CG2AVAL B 107C    -11.104   6.134  -6.504  0.50 12.00      SEGA C1+\n";
  const PdbStructure structure = parse_pdb(line, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 1U);
  const PdbResidue& residue = structure.residues[0];
  EXPECT_EQ(residue.name, "VAL");
  EXPECT_EQ(residue.chain, "B");
  EXPECT_EQ(residue.id, "107C");
  ASSERT_EQ(residue.atoms.size(), 1U);
  EXPECT_EQ(residue.atoms[0].name, "CG2");
  EXPECT_EQ(residue.atoms[0].element, "C");
  EXPECT_EQ(residue.atoms[0].position_angstrom, Vec3(-11.104, 6.134, -6.504));
}

TEST(PdbReader, IgnoresTheColumnsAfterTheCoordinates) {
  const std::string bare = test::to_text({.name = " CA ", .x = 1.5}).substr(0, 54);
  for (const std::string& line : {bare, bare + "\r\n", bare + "  1.00 20.00      1PPE 268\n",
                                  bare + std::string(200, '?'), bare + "  1.00 20.00          XX9-\r\n"}) {
    const PdbStructure structure = parse_pdb(line, "x.pdb");
    ASSERT_EQ(structure.residues.size(), 1U) << line;
    EXPECT_EQ(structure.residues[0].atoms[0].element, "C") << line;
    EXPECT_EQ(structure.residues[0].atoms[0].position_angstrom.x(), 1.5) << line;
  }
}

TEST(PdbReader, InsertionCodesSeparateResidues) {
  const std::string text =
      test::to_text({.name = " CA ", .number = 5}) + test::to_text({.name = " CA ", .number = 5, .insertion = 'A'});
  const PdbStructure structure = parse_pdb(text, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 2U);
  EXPECT_EQ(structure.residues[0].id, "5");
  EXPECT_EQ(structure.residues[1].id, "5A");
}

TEST(PdbReader, KeepsTheAlternateLocationOfTheLargerOccupancyThroughoutAResidue) {
  std::string text = test::to_text({.name = " CA ", .x = 1}) +
                     test::to_text({.name = " CB ", .alternate = 'A', .x = 2, .occupancy = 0.5}) +
                     test::to_text({.name = " CB ", .alternate = 'B', .x = 3, .occupancy = 0.5}) +
                     test::to_text({.name = " HB ", .alternate = 'B', .x = 4, .occupancy = 0.5}) +
                     test::to_text({.name = " HB ", .alternate = 'A', .x = 5, .occupancy = 0.5}) +
                     test::to_text({.name = " CG ", .alternate = 'B', .x = 6, .occupancy = 0.5});
  const auto places = [](const PdbStructure& structure) {
    std::vector<double> x;
    for (const PdbAtom& atom : structure.residues.at(0).atoms) x.push_back(atom.position_angstrom.x());
    return x;
  };
  // If the occupancies of two alternate locations are equal, the location with more atoms is chosen. A mixture of both
  // locations would be a wrong structure.
  EXPECT_EQ(places(parse_pdb(text, "x.pdb")), (std::vector<double>{1, 3, 4, 6}));
  text.replace(text.find("  0.50"), 6, "  0.60");
  const PdbStructure structure = parse_pdb(text, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 1U);
  EXPECT_EQ(places(structure), (std::vector<double>{1, 2, 5}));
  EXPECT_EQ(structure.alternate_atoms, 3U);
}

TEST(PdbReader, KeepsTheFirstResidueNameWhereTwoShareAPlace) {
  const std::string text = test::to_text({.name = " CA ", .residue = "SER", .alternate = 'A'}) +
                           test::to_text({.name = " CA ", .residue = "THR", .alternate = 'B'});
  const PdbStructure structure = parse_pdb(text, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 1U);
  EXPECT_EQ(structure.residues[0].name, "SER");
}

TEST(PdbReader, CountsDuplicateAtoms) {
  const std::string atom = test::to_text({.name = " CA "});
  const PdbStructure structure = parse_pdb(atom + atom, "x.pdb");
  EXPECT_EQ(structure.residues[0].atoms.size(), 1U);
  EXPECT_EQ(structure.duplicate_atoms, 1U);
}

TEST(PdbReader, ReadsTheFirstModelOnly) {
  const std::string atom = test::to_text({.name = " CA "});
  const std::string other = test::to_text({.name = " CA ", .number = 2});
  const PdbStructure structure =
      parse_pdb("MODEL        1\n" + atom + "ENDMDL\nMODEL        2\n" + other + "ENDMDL\n", "x.pdb");
  EXPECT_EQ(structure.residues.size(), 1U);
  EXPECT_TRUE(structure.has_more_models);
  EXPECT_FALSE(parse_pdb(atom + "END\n", "x.pdb").has_more_models);
}

TEST(PdbReader, TerSeparatesResiduesOfTheSameChainAndNumber) {
  const std::string atom = test::to_text({.name = " CA "});
  const PdbStructure structure = parse_pdb(atom + "TER\n" + atom, "x.pdb");
  ASSERT_EQ(structure.residues.size(), 2U);
  EXPECT_EQ(structure.residues[1].segment, 1);
}

TEST(PdbReader, RefusesACoordinateThatIsNotFiniteWithItsPosition) {
  const std::string good = test::to_text({.name = " CA "});
  for (const std::string field :
       {"     nan", "     inf", "   1e999", "        ", "  1.2.3 ", "********", "   1e300", "99999999"}) {
    const std::string message = message_of(good + good.substr(0, 38) + field + good.substr(46));
    EXPECT_NE(message.find("x.pdb:2: coordinate y in columns 39-46"), std::string::npos) << message;
    EXPECT_NE(message.find("correct or delete"), std::string::npos) << message;
  }
  EXPECT_NE(message_of(good.substr(0, 52)).find("x.pdb:1: atom line ends at column 52"), std::string::npos);
}

TEST(PdbReader, BoundsTheNumberOfAtoms) {
  const std::string atom = test::to_text({.name = " CA "}).substr(0, 54) + "\n";
  std::string text;
  for (int i = 0; i < 1'000'001; ++i) text += atom;
  EXPECT_NE(message_of(text).find("x.pdb:1000001: more than 1000000 atoms"), std::string::npos);
}

TEST(PdbReader, MissingFilesAndFoldersAreErrorsNotCrashes) {
  EXPECT_THROW(read_structure("/nowhere/at/all.pdb"), docking::MoleculeError);
  EXPECT_THROW(read_structure("/tmp"), docking::MoleculeError);
  EXPECT_TRUE(parse_pdb("", "x.pdb").residues.empty());
}

/// Parses hostile bytes. MoleculeError is the only permitted exception, and all coordinates must be finite.
void expect_no_crash(const std::string& text, unsigned seed) {
  try {
    const PdbStructure structure = parse_pdb(text, "x.pdb");
    for (const PdbResidue& residue : structure.residues) {
      for (const PdbAtom& atom : residue.atoms) EXPECT_TRUE(is_finite(atom.position_angstrom)) << "seed " << seed;
    }
  } catch (const docking::MoleculeError& error) {
    EXPECT_FALSE(std::string(error.what()).empty());
  }
}

TEST(PdbReader, SurvivesTruncatedAndDamagedFiles) {
  const std::string valid = test::residue_text("ALA", "N H CA HA CB 1HB 2HB 3HB C O", 1) + "TER\n" +
                            test::residue_text("GLY", "N CA C O OXT", 2) + "END\n";
  for (unsigned seed = 0; seed < 2000; ++seed) {
    std::mt19937 random(seed);
    std::string text = valid.substr(0, random() % (valid.size() + 1));
    for (unsigned i = 0; i < seed % 20 && !text.empty(); ++i)
      text[random() % text.size()] = static_cast<char>(random());
    expect_no_crash(text, seed);
  }
}

TEST(PdbReader, SurvivesRandomBytes) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    std::mt19937 random(seed);
    std::string text(random() % 4096, '\0');
    for (char& c : text) c = static_cast<char>(random());
    for (std::size_t at = 0; at + 7 < text.size(); at += 100) text.replace(at, 7, "\nATOM  ");
    expect_no_crash(text, seed);
  }
}

}  // namespace
}  // namespace tandem::server
