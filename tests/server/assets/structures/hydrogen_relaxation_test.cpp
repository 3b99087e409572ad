// Tests the relaxation of built hydrogens: only hydrogens that overlap other atoms are moved, and only as far as
// necessary. All other atoms must keep their positions.
#include "server/assets/structures/hydrogen_relaxation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "common/docking/atom_contacts.hpp"
#include "server/assets/structures/atom_grid.hpp"
#include "server/assets/structures/elements.hpp"
#include "server/assets/structures/loader.hpp"
#include "server/assets/structures/prepared_structure.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

const std::filesystem::path kUbiquitin = "/usr/share/freesasa/test-data/1ubq.pdb";
const std::filesystem::path kProtease = "/usr/share/pymol/data/tut/1hpv.pdb";

/// Residue "SER" with only a carbon, an oxygen and a built hydroxyl hydrogen.
struct Hydroxyl {
  Hydroxyl(const std::string& id, const Vec3& oxygen, const Vec3& carbon, const Vec3& hydrogen) {
    residue.name = "SER";
    residue.id = id;
    residue.chain = "A";
    for (const auto& [name, place] :
         std::vector<std::pair<std::string, Vec3>>{{"CB", carbon}, {"OG", oxygen}, {"HG", hydrogen}}) {
      PdbAtom atom;
      atom.name = name;
      atom.element = name.substr(0, 1);
      atom.position_angstrom = place;
      residue.atoms.push_back(atom);
    }
    group.names = {"HG"};
    group.carrier_angstrom = oxygen;
    group.axis_angstrom = carbon;
    group.turns = true;
  }

  PdbResidue residue;
  BuiltGroup group;
};

struct Structure {
  std::vector<PdbResidue> chains, others;
  std::vector<BuiltGroup> groups;

  void add(const Hydroxyl& hydroxyl) {
    groups.push_back(hydroxyl.group);
    groups.back().residue = chains.size();
    chains.push_back(hydroxyl.residue);
  }
  RelaxedPart part() { return {&chains, &others, &groups}; }
  const Vec3& hydrogen(std::size_t residue) const { return chains[residue].atoms[2].position_angstrom; }
};

/// Returns two hydroxyl groups, each with its carbon-oxygen bond along x. Their hydrogens overlap at a distance of 0.9
/// Å.
Structure two_hydroxyls() {
  const double down = -1.0 / 3, out = std::sqrt(8.0) / 3;  // components for an angle of 109.5° at the oxygen
  Structure structure;
  structure.add({"1", {0, 0, 0}, {-1.43, 0, 0}, {-down, out, 0}});
  structure.add({"2", {0, 2 * out + 0.9, 0}, {-1.43, 2 * out + 0.9, 0}, {-down, out + 0.9, 0}});
  return structure;
}

TEST(HydrogenRelaxation, AHydroxylThatOverlapsTurnsAndKeepsItsBond) {
  Structure structure = two_hydroxyls();
  const std::vector<RelaxedPart> parts{structure.part()};
  const RelaxedHydrogens relaxed = relax_hydrogens(parts);
  EXPECT_GT((structure.hydrogen(0) - structure.hydrogen(1)).norm(), docking::kClashShare * 2.2);
  EXPECT_TRUE(relaxed.clashes.empty()) << relaxed.clashes.front();
  ASSERT_FALSE(relaxed.moved.empty());
  EXPECT_NE(relaxed.moved.front().find("turned by"), std::string::npos) << relaxed.moved.front();
  for (std::size_t r = 0; r < 2; ++r) {
    const Vec3 bond = structure.hydrogen(r) - structure.groups[r].carrier_angstrom;
    EXPECT_NEAR(bond.norm(), 1, 1e-9);
    EXPECT_NEAR(bond.x(), 1.0 / 3, 1e-9) << "turned only";
  }
}

TEST(HydrogenRelaxation, AHydrogenWithoutOverlapIsNotMoved) {
  Structure structure = two_hydroxyls();
  structure.chains.pop_back();
  structure.groups.pop_back();
  const Vec3 built = structure.hydrogen(0);
  const std::vector<RelaxedPart> parts{structure.part()};
  const RelaxedHydrogens relaxed = relax_hydrogens(parts);
  EXPECT_EQ(structure.hydrogen(0), built);
  EXPECT_TRUE(relaxed.moved.empty());
}

TEST(HydrogenRelaxation, AHydrogenThatCannotTurnBends) {
  Structure structure = two_hydroxyls();
  for (BuiltGroup& group : structure.groups) group.turns = false;
  const double before = (structure.hydrogen(0) - structure.hydrogen(1)).norm();
  const std::vector<RelaxedPart> parts{structure.part()};
  const RelaxedHydrogens relaxed = relax_hydrogens(parts);
  EXPECT_GT((structure.hydrogen(0) - structure.hydrogen(1)).norm(), before + 0.4);
  EXPECT_NEAR(structure.hydrogen(0).norm(), 1, 1e-9);
  ASSERT_EQ(relaxed.moved.size(), 2U);
  EXPECT_NE(relaxed.moved.front().find("bent by"), std::string::npos) << relaxed.moved.front();
}

TEST(HydrogenRelaxation, AStructureBesideCountsAndOneInAnotherFrameDoesNot) {
  const Structure both = two_hydroxyls();
  Structure first = both, beside = both;
  first.chains.pop_back();
  first.groups.pop_back();
  beside.chains.erase(beside.chains.begin());
  beside.groups.erase(beside.groups.begin());
  beside.groups[0].residue = 0;
  const Vec3 built = first.hydrogen(0);
  Structure elsewhere = first;
  elsewhere.chains[0].atoms[0].position_angstrom += Vec3(0.5, 0, 0);
  relax_hydrogens(std::vector{first.part(), elsewhere.part()});
  EXPECT_EQ(first.hydrogen(0), built) << "heavy atoms on each other";
  relax_hydrogens(std::vector{first.part(), beside.part()});
  EXPECT_GT((first.hydrogen(0) - beside.hydrogen(0)).norm(), docking::kClashShare * 2.2);
}

TEST(HydrogenRelaxation, OfAtomsThatLieOnEachOtherEndsInSeconds) {
  std::mt19937 random(static_cast<std::uint32_t>(test::test_seed(1)));
  std::uniform_real_distribution<double> anywhere(0, 10);
  Structure structure;
  for (int n = 0; n < 1500; ++n) {
    const Vec3 oxygen(anywhere(random), anywhere(random), anywhere(random));
    structure.add({std::to_string(n), oxygen, oxygen - Vec3(1.43, 0, 0), oxygen + Vec3(1, 0, 0)});
  }
  relax_hydrogens(std::vector{structure.part()});
  for (std::size_t r = 0; r < structure.chains.size(); ++r) {
    EXPECT_NEAR((structure.hydrogen(r) - structure.groups[r].carrier_angstrom).norm(), 1, 1e-9);
  }
}

PreparedStructure built(const std::filesystem::path& file) {
  const ForceField force_field = load_force_field(test::kOplsDirectory);
  PreparedStructure structure = read_residues(file, force_field);
  complete_residues(structure, force_field, Hydrogens::kBuild, {}, file.string());
  return structure;
}

/// Returns the positions of the atoms by residue and atom name.
std::map<std::string, Vec3> places(const std::vector<PdbResidue>& residues) {
  std::map<std::string, Vec3> all;
  for (const PdbResidue& residue : residues) {
    for (const PdbAtom& atom : residue.atoms) all[place_text(residue, atom.name)] = atom.position_angstrom;
  }
  return all;
}

/// Returns the structure rotated and displaced, with its residues in random order. Relaxation must give the same
/// result.
PreparedStructure rewritten(const PreparedStructure& from, const Pose& X, std::mt19937& random) {
  PreparedStructure to = from;
  std::vector<std::size_t> order(from.chains.size());
  for (std::size_t r = 0; r < order.size(); ++r) order[r] = r;
  std::shuffle(order.begin(), order.end(), random);
  for (std::size_t r = 0; r < order.size(); ++r) {
    to.chains[r] = from.chains[order[r]];
    for (PdbAtom& atom : to.chains[r].atoms) atom.position_angstrom = X * atom.position_angstrom;
  }
  for (PdbResidue& residue : to.others) {
    for (PdbAtom& atom : residue.atoms) atom.position_angstrom = X * atom.position_angstrom;
  }
  for (BuiltGroup& group : to.groups) {
    group.residue = static_cast<std::size_t>(std::ranges::find(order, group.residue) - order.begin());
    // A group is matched to its carrier atom by equal coordinates. They must be equal bit by bit, so both are
    // transformed in the same way.
    for (const PdbAtom& atom : from.chains[order[group.residue]].atoms) {
      if (atom.position_angstrom == group.carrier_angstrom) group.carrier_angstrom = X * atom.position_angstrom;
    }
    group.axis_angstrom = X * group.axis_angstrom;
  }
  return to;
}

TEST(HydrogenRelaxation, OfAProteinOnlyHydrogensThatOverlapMove) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory, kProtease);
  PreparedStructure structure = built(kProtease);
  const std::map<std::string, Vec3> before = places(structure.chains);
  const std::vector<RelaxedPart> parts{{&structure.chains, &structure.others, &structure.groups}};
  const RelaxedHydrogens relaxed = relax_hydrogens(parts);
  std::size_t moved = 0;
  for (const auto& [name, place] : places(structure.chains)) {
    if (place == before.at(name)) continue;
    ++moved;
    EXPECT_TRUE(name.starts_with("H")) << name;
  }
  EXPECT_GT(moved, 0U);
  EXPECT_LE(moved, 3 * relaxed.moved.size());
  EXPECT_LT(relaxed.moved.size(), structure.groups.size() / 10);
}

TEST(HydrogenRelaxation, DoesNotDependOnTheFrameOrTheOrderOfResidues) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory, kUbiquitin, kProtease);
  std::mt19937 random(static_cast<std::uint32_t>(test::test_seed(1)));
  for (const auto& file : {kUbiquitin, kProtease}) {
    const PreparedStructure original = built(file);
    PreparedStructure expected = original;
    relax_hydrogens(std::vector<RelaxedPart>{{&expected.chains, &expected.others, &expected.groups}});
    const std::map<std::string, Vec3> there = places(expected.chains);
    const Pose X{Vec3(31, -17, 5), test::random_rotation(random)};
    PreparedStructure other = rewritten(original, X, random);
    relax_hydrogens(std::vector<RelaxedPart>{{&other.chains, &other.others, &other.groups}});
    for (const auto& [name, place] : places(other.chains)) {
      EXPECT_LT((place - X * there.at(name)).norm(), 1e-5) << name << " of " << file;
    }
  }
}

docking::Molecule molecule_of(const std::vector<PdbResidue>& residues) {
  docking::Molecule molecule;
  for (const PdbResidue& residue : residues) {
    for (const PdbAtom& atom : residue.atoms) {
      molecule.positions_angstrom.push_back(atom.position_angstrom);
      molecule.elements.push_back(atom.element);
      molecule.mass_u.push_back(find_element(atom.element)->mass_u);
    }
  }
  return molecule;
}

/// Returns the smallest distance between heavy atoms of the two structures [Å], at most 5.
double gap_angstrom(const PreparedStructure& a, const PreparedStructure& b) {
  constexpr double kFarAngstrom = 5;
  const auto heavy = [](const PreparedStructure& structure) {
    std::vector<Vec3> all;
    for (const PdbResidue& residue : structure.chains) {
      for (const PdbAtom& atom : residue.atoms) {
        if (atom.element != "H") all.push_back(atom.position_angstrom);
      }
    }
    return all;
  };
  const std::vector<Vec3> of_a = heavy(a);
  const AtomGrid grid(kFarAngstrom, of_a);
  double least = kFarAngstrom;
  for (const Vec3& place : heavy(b)) {
    grid.visit_near(place, [&](std::size_t i) { least = std::min(least, (of_a[i] - place).norm()); });
  }
  return least;
}

void relax(PreparedStructure& one, PreparedStructure& two) {
  relax_hydrogens(
      std::vector<RelaxedPart>{{&one.chains, &one.others, &one.groups}, {&two.chains, &two.others, &two.groups}});
}

std::size_t clashes_between(const PreparedStructure& a, const PreparedStructure& b) {
  const std::vector<docking::CloseAtoms> close =
      docking::close_atoms(molecule_of(a.chains), molecule_of(b.chains), Pose{});
  return static_cast<std::size_t>(
      std::ranges::count(close, docking::Closeness::kClash, &docking::CloseAtoms::closeness));
}

TEST(HydrogenRelaxation, OfPiecesPressedTogetherClashesBecomeFewAndTheOrderDoesNotMatter) {
  TANDEM_NEEDS_FILES(test::kOplsDirectory, kUbiquitin);
  // Gap between the heavy atoms of the two pieces, as in a real interface: there it is 2.6 to 3 Å, with hydrogens
  // between.
  constexpr double kGapAngstrom = 2.8;
  constexpr int kTrials = 30;
  std::mt19937 random(static_cast<std::uint32_t>(test::test_seed(1)));
  const PreparedStructure ubiquitin = built(kUbiquitin);
  const Vec3 centre = molecule_of(ubiquitin.chains).centre_of_mass_angstrom();
  std::size_t before = 0, after = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Quat q = test::random_rotation(random);
    const PreparedStructure turned = rewritten(ubiquitin, {centre - q * centre, q}, random);
    PreparedStructure other;
    double way = 15;
    do {
      way += 0.1;
      other = rewritten(turned, {Vec3(way, 0, 0), Quat::Identity()}, random);
    } while (gap_angstrom(ubiquitin, other) < kGapAngstrom);
    PreparedStructure a = ubiquitin, b = other, a_swapped = ubiquitin, b_swapped = other;
    before += clashes_between(a, b);
    relax(a, b);
    relax(b_swapped, a_swapped);
    after += clashes_between(a, b);
    const std::map<std::string, Vec3> swapped = places(a_swapped.chains);
    for (const auto& [name, place] : places(a.chains)) EXPECT_LT((place - swapped.at(name)).norm(), 1e-5) << name;
  }
  std::cout << before << " clashes before, " << after << " after\n";
  EXPECT_GT(before, 0U);
  EXPECT_LE(5 * after, before);
}

}  // namespace
}  // namespace tandem::server
