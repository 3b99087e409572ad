#include "client/view/molecule/residue_selection.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>

#include "client/view/molecule/molecule_mouse.hpp"
#include "client/view/molecule/residue_range.hpp"

namespace tandem::client {
namespace {

/// Adds residues of two atoms each, along x, 4 Å apart; the atoms of a residue are 1.5 Å apart along y.
void add_residue(docking::Molecule& molecule, const std::string& chain, const std::string& id,
                 const std::string& name) {
  for (const char* const atom : {"N", "CA"}) {
    const double across = atom[0] == 'N' ? 0 : 1.5;
    molecule.positions_angstrom.emplace_back(4.0 * static_cast<double>(molecule.size() / 2), across, 0);
    molecule.atom_names.emplace_back(atom);
    molecule.elements.emplace_back(atom[0] == 'N' ? "N" : "C");
    molecule.residue_names.push_back(name);
    molecule.residue_ids.push_back(id);
    molecule.chains.push_back(chain);
    molecule.segments.push_back(0);
    molecule.mass_u.push_back(12);
  }
}

/// Two molecules: chain A with the residues 9, 10, 10A and 11, and chain B with the residue −2. They are drawn a
/// thousand times larger than real molecules: 1 Å is 1e-7 m.
class ResidueSelectionTest : public testing::Test {
 protected:
  static constexpr double kScale = 1e-7;

  ResidueSelectionTest() {
    docking::Molecule a, b;
    for (const char* const id : {"9", "10", "10A", "11"}) add_residue(a, "A", id, "GLU");
    add_residue(b, "B", "-2", "LYS");
    scene_.bodies.emplace_back().name = "table";
    scene_.bodies.emplace_back().molecule = std::make_shared<const docking::Molecule>(a);
    scene_.bodies.emplace_back().molecule = std::make_shared<const docking::Molecule>(b);
    X_WB_.resize(3);
    X_WB_[2].p = {0, 0, 30 * kScale};
  }
  /// Returns the first atom that is hit by a ray along −z. The ray starts at the point (x, y, from_z) [Å].
  std::optional<AtomPlace> at(double x, double y, double from_z = 100) const {
    return first_atom(scene_, X_WB_, kScale, kScale * Vec3(x, y, from_z), -Vec3::UnitZ());
  }
  std::size_t count_of(const char* text) {
    EXPECT_EQ(selection_.select(scene_, text), "") << text;
    return selection_.residues().size();
  }

  /// A frame with the mouse over the atom {2, 0}.
  MoleculeFrame frame_at(bool is_click) const {
    return {.scene = scene_,
            .X_WB = X_WB_,
            .metres_per_angstrom = kScale,
            .from_W = Vec3(0, 0, 100 * kScale),
            .along_W = -Vec3::UnitZ(),
            .is_free = true,
            .is_click = is_click};
  }

  DrawnScene scene_;
  std::vector<Pose> X_WB_;
  ResidueSelection selection_;
};

TEST_F(ResidueSelectionTest, TheFirstAtomOnARayIsFound) {
  EXPECT_EQ(at(0, 0), (AtomPlace{2, 0})) << "the molecule in front";
  EXPECT_EQ(at(0, 0, 20), (AtomPlace{1, 0})) << "seen from between them";
  EXPECT_EQ(at(4, 1.5), (AtomPlace{1, 3}));
  EXPECT_EQ(at(4, 1.5, -20), std::nullopt) << "all atoms are behind the eye";
  EXPECT_EQ(at(2, 40), std::nullopt);
}

TEST_F(ResidueSelectionTest, ARotatedMoleculeIsHitWhereItIs) {
  X_WB_[2].q = quaternion_of(Vec3(0, 0, std::numbers::pi / 2));
  EXPECT_EQ(at(-1.5, 0), (AtomPlace{2, 1}));
}

TEST_F(ResidueSelectionTest, AtomsAreNamedByResidueNumberAndChain) {
  const docking::Molecule& molecule = *scene_.bodies[1].molecule;
  EXPECT_EQ(residue_text(molecule, 4), "GLU 10A of chain A");
  EXPECT_EQ(atom_text(molecule, 5), "GLU 10A of chain A, atom CA");
  EXPECT_EQ(short_atom_text(molecule, 5), "A:GLU 10A CA");
  docking::Molecule nameless;
  nameless.positions_angstrom.resize(3);
  EXPECT_EQ(atom_text(nameless, 2), "atom 3");
}

TEST_F(ResidueSelectionTest, AClickSelectsTheResidueAndASecondOneTakesItBack) {
  selection_.click(scene_, {1, 5});
  EXPECT_EQ(selection_.residues(), (std::set<AtomPlace>{{1, 4}}));
  selection_.click(scene_, {1, 1});
  EXPECT_EQ(selection_.residues(), (std::set<AtomPlace>{{1, 0}, {1, 4}}));
  selection_.click(scene_, {1, 5});
  EXPECT_EQ(selection_.residues(), (std::set<AtomPlace>{{1, 0}}));
  EXPECT_EQ(selection_.picked(), (std::vector<AtomPlace>{{1, 1}}));
  selection_.click(scene_, {7, 0});
  selection_.click(scene_, {0, 0});
  selection_.click(scene_, {1, 99});
  EXPECT_EQ(selection_.residues().size(), 1U) << "atoms that do not exist";
}

TEST_F(ResidueSelectionTest, TwoPickedAtomsHaveTheirDistanceAcrossMolecules) {
  EXPECT_FALSE(selection_.distance(scene_, X_WB_, kScale));
  selection_.click(scene_, {1, 0});
  selection_.click(scene_, {2, 0});
  EXPECT_NEAR(selection_.distance(scene_, X_WB_, kScale)->angstrom, 30, 1e-9);
  X_WB_[2].p.z() = 5 * kScale;
  EXPECT_NEAR(selection_.distance(scene_, X_WB_, kScale)->angstrom, 5, 1e-9) << "it follows the molecules";
  selection_.click(scene_, {1, 2});
  EXPECT_EQ(selection_.picked(), (std::vector<AtomPlace>{{2, 0}, {1, 2}})) << "the last two";
  selection_.clear();
  EXPECT_FALSE(selection_.distance(scene_, X_WB_, kScale));
}

TEST_F(ResidueSelectionTest, RangesAreSelectedByNumberChainAndInsertionCode) {
  EXPECT_EQ(count_of("A:10-11"), 3U);
  EXPECT_EQ(count_of("A:10"), 2U) << "with and without an insertion code";
  EXPECT_EQ(count_of("A:10A"), 1U);
  EXPECT_EQ(count_of("B:-2"), 1U);
  EXPECT_EQ(count_of("-5-9"), 2U) << "in all chains";
  EXPECT_EQ(count_of("A"), 4U);
  EXPECT_EQ(count_of("A:"), 4U);
  EXPECT_EQ(count_of(" A:9 , B:-2-5 "), 2U);
}

TEST_F(ResidueSelectionTest, AnotherTextIsExplainedAndChangesNothing) {
  count_of("A");
  for (const char* const text : {"", ":", ":5", "A:x", "A:10-", "A:11-10", "A:10-11-12", "A:10,,", "A B", "A:10AB",
                                 "C:1", "A:99999999999", "!", "A:10-11B"}) {
    EXPECT_NE(selection_.select(scene_, text), "") << text;
    EXPECT_EQ(selection_.residues().size(), 4U) << text;
  }
  EXPECT_NE(selection_.select(scene_, "C:1").find("The chains are A, B."), std::string::npos);
  std::string many = "A:9";
  for (std::size_t i = 0; i < kMaxRanges; ++i) many += ",A:9";
  EXPECT_NE(selection_.select(scene_, many), "");
}

TEST_F(ResidueSelectionTest, AChainWithANumericNameIsSelectedByAColon) {
  EXPECT_EQ(parse_residues("1:"), std::vector{ResidueRange{.chain = "1"}});
  EXPECT_EQ(parse_residues("1"), (std::vector{ResidueRange{.first = 1, .last = 1}})) << "the residue 1 of all chains";
}

TEST_F(ResidueSelectionTest, ATypedRangeRemovesTheDistance) {
  selection_.click(scene_, {1, 0});
  selection_.click(scene_, {2, 0});
  count_of("A:9");
  EXPECT_TRUE(selection_.picked().empty());
  EXPECT_FALSE(selection_.distance(scene_, X_WB_, kScale));
}

TEST_F(ResidueSelectionTest, ResiduesAreThoseOfTheDocking) {
  docking::Molecule molecule = *scene_.bodies[1].molecule;
  add_residue(molecule, "A", "11", "SER");  // another name alone
  add_residue(molecule, "B", "11", "SER");
  add_residue(molecule, "B", "11", "SER");
  molecule.segments.back() = molecule.segments[molecule.size() - 2] = 1;
  std::vector<std::size_t> starts;
  for (std::size_t start = 0; start < molecule.size(); start = residue_end(molecule, start)) {
    starts.push_back(start);
    EXPECT_EQ(residue_start(molecule, start + 1), start);
  }
  EXPECT_EQ(starts, docking::residue_starts(molecule));
  EXPECT_EQ(starts.size(), 7U);
}

TEST_F(ResidueSelectionTest, AtomsThatAreCutAwayAreNotFound) {
  const auto cut_at = [&](double z, const Vec3& along) {
    const Eigen::Hyperplane<double, 3> cut_W(-Vec3::UnitZ(), Vec3(0, 0, z * kScale));
    return first_atom(scene_, X_WB_, kScale, kScale * Vec3(0, 0, 100), along, cut_W);
  };
  EXPECT_EQ(cut_at(50, -Vec3::UnitZ()), (AtomPlace{2, 0})) << "in front of both molecules";
  EXPECT_EQ(cut_at(15, -2 * Vec3::UnitZ()), (AtomPlace{1, 0})) << "between them";
  EXPECT_EQ(cut_at(-15, -Vec3::UnitZ()), std::nullopt);
  EXPECT_EQ(cut_at(15, Vec3::UnitX()), std::nullopt) << "a ray along the plane";
}

TEST_F(ResidueSelectionTest, SurvivesARejoinOfTheSameMolecules) {
  const auto joined = [](const std::string& sha256) {
    auto made = std::make_shared<wire::Joined>();
    made->mutable_scene()->add_bodies()->add_shapes()->mutable_molecule()->set_asset_sha256(sha256);
    return made;
  };
  MoleculeMouse mouse;
  mouse.belong_to(joined("one"));
  mouse.follow(frame_at(true));
  ASSERT_FALSE(mouse.selection().is_empty());
  mouse.belong_to(joined("one"));
  EXPECT_FALSE(mouse.selection().is_empty());
  mouse.belong_to(nullptr);
  EXPECT_FALSE(mouse.selection().is_empty());
  mouse.belong_to(joined("another"));
  EXPECT_TRUE(mouse.selection().is_empty());
}

TEST_F(ResidueSelectionTest, ADoubleClickGrabsAndSelectsNothing) {
  MoleculeMouse mouse;
  LocalTime now{};
  const auto follow = [&](bool is_click, bool is_double_click, int after_ms) {
    now += std::chrono::milliseconds(after_ms);
    MoleculeFrame frame = frame_at(is_click);
    frame.is_free = is_click;  // the mouse is free when its button is released, but not when it is pressed
    frame.is_double_click = is_double_click;
    frame.now = now;
    mouse.follow(frame);
  };
  follow(true, false, 1000);
  const auto before = mouse.selection().residues();
  ASSERT_EQ(before.size(), 1U);
  follow(true, false, 2000);  // a second click on the residue deselects it
  EXPECT_TRUE(mouse.selection().is_empty());
  follow(false, true, 200);
  EXPECT_EQ(mouse.selection().residues(), before) << "the first click of the double click is taken back";
  follow(true, false, 100);
  EXPECT_EQ(mouse.selection().residues(), before) << "the second one is ignored";
  follow(true, false, 2000);
  EXPECT_TRUE(mouse.selection().is_empty()) << "a later click selects";
  follow(false, true, 2000);
  EXPECT_TRUE(mouse.selection().is_empty()) << "an earlier click stays";
  follow(true, false, 50);
  follow(true, false, 50);
  EXPECT_TRUE(mouse.selection().is_empty()) << "both releases follow the double click in a slow frame";
}

TEST_F(ResidueSelectionTest, TheMouseOverAPanelOrInADragHasNoAtom) {
  MoleculeMouse mouse;
  MoleculeFrame frame{.scene = scene_,
                      .X_WB = X_WB_,
                      .metres_per_angstrom = kScale,
                      .from_W = Vec3(0, 0, 100 * kScale),
                      .along_W = -Vec3::UnitZ(),
                      .is_free = true};
  mouse.follow(frame);
  EXPECT_EQ(mouse.content(scene_).under_mouse, "LYS -2 of chain B, atom N");
  EXPECT_TRUE(mouse.selection().is_empty());
  frame.is_click = true;
  mouse.follow(frame);
  EXPECT_EQ(mouse.selection().residues(), (std::set<AtomPlace>{{2, 0}}));
  frame.is_click = frame.is_free = false;
  mouse.follow(frame);
  EXPECT_EQ(mouse.content(scene_).under_mouse, "");
  EXPECT_FALSE(mouse.selection().is_empty());
  mouse.clear();
  EXPECT_TRUE(mouse.selection().is_empty());
}

TEST_F(ResidueSelectionTest, TheLegendNamesEachColourOnce) {
  const docking::Molecule& molecule = *scene_.bodies[1].molecule;
  const Rgba own{0.1F, 0.2F, 0.3F, 1};
  const auto by_element = legend_of(molecule, MoleculeStyle::kByElement, own);
  ASSERT_EQ(by_element.size(), 2U);
  EXPECT_EQ(by_element[1], (LegendEntry{"C", own}));
  EXPECT_EQ(legend_of(molecule, MoleculeStyle::kByChain, own, 3),
            (std::vector<LegendEntry>{{"chain A", chain_color(3)}}));
  const auto by_residue = legend_of(molecule, MoleculeStyle::kByResidue, own);
  ASSERT_EQ(by_residue.size(), 1U);
  EXPECT_EQ(by_residue[0].text, "acidic");
  EXPECT_EQ(by_residue[0].color, atom_colors(molecule, MoleculeStyle::kByResidue, own)[0]);
}

}  // namespace
}  // namespace tandem::client
