// Tests how the energy of a pair of molecules is summed in a room: the chosen model for large pairs, and the reported
// errors. A wrong choice would flatten the energy well that users feel, without a warning.
#include "server/assets/field_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>
#include <vector>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "server/assets/docking_scene.hpp"
#include "server/assets/molecular_scale.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using docking::FieldModel;
using docking::Molecule;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr unsigned kFieldChoiceSeed = 61;

FieldModel model_4r(double cutoff_angstrom, bool has_far_grid) {
  FieldModel model;
  docking::set_dielectric(model, "4r");
  model.cutoff_angstrom = cutoff_angstrom;
  model.has_far_grid = has_far_grid;
  return model;
}

struct ProteinPair {
  std::mt19937 random{static_cast<unsigned>(test::test_seed(kFieldChoiceSeed))};
  Molecule a, b;

  ProteinPair(std::size_t atoms_a, std::size_t atoms_b)
      : a(test::protein_like(atoms_a, 1, random)), b(test::protein_like(atoms_b, -1, random)) {
    a.centre();
    b.centre();
  }
};

TEST(WayIn, MeasuresWhatACutOffLosesOfTheWellAndTheNoteNamesTheRemedy) {
  const ProteinPair pair(2'000, 1'500);
  const Vec3 line(0, 0.6, 0.8);
  const FieldModel cut = model_4r(8, false);
  const auto check_of = way_in(pair.a, pair.b, cut, line);
  const WellCheck lost = check_of(cut);
  double well = 0, error = 0;
  const double contact = contact_distance_angstrom(pair.a, pair.b, cut, line);
  for (const double out : {0.0, 0.5, 1.0, 2.0, 3.5, 5.0}) {
    const Pose X_AB{(contact + out) * line, Quat::Identity()};
    const double all = exact_field(pair.a, pair.b, X_AB, model_4r(0, false)).energy_kj_per_mol();
    well = std::min(well, all);
    error = std::max(error, std::abs(exact_field(pair.a, pair.b, X_AB, cut).energy_kj_per_mol() - all));
  }
  EXPECT_NEAR(lost.well_kj_per_mol, well, 1e-3 * std::abs(well));
  EXPECT_NEAR(lost.error_kj_per_mol, error, 1e-3 * std::abs(well));
  ASSERT_FALSE(lost.is_kept()) << "the pair must lose a part of its well";
  EXPECT_THAT(well_note(lost), HasSubstr("doubtful"));
  EXPECT_THAT(well_note(lost), HasSubstr("--far-grid"));
  EXPECT_THAT(well_note(lost), HasSubstr("% of the well"));
  const WellCheck kept = check_of(model_4r(8, true));
  EXPECT_TRUE(kept.is_kept()) << kept.error_kj_per_mol << " of " << kept.well_kj_per_mol << " kJ/mol";
  EXPECT_THAT(well_note(kept), Not(HasSubstr("doubtful")));
}

TEST(ChooseField, UsesAnAvailableGridAndTheSameFieldForSwappedRoles) {
  const ProteinPair pair(900, 5'000);
  FieldModel one = model_4r(0, false), swapped = one;
  choose_field(pair.a, pair.b, Vec3(9, 0, 0), one);
  choose_field(pair.b, pair.a, Vec3(-9, 0, 0), swapped);
  EXPECT_EQ(one, model_4r(8, true));
  EXPECT_EQ(swapped, one);
}

TEST(ChooseField, OfTooManyAtomsForAGridIsTheSmallestCutOffThatKeepsTheWellOrErrsLeast) {
  const ProteinPair pair(12'100, 12'050);
  const Vec3 offset(0, 0, 60);
  // In a model without charges, all terms beyond the cut-off are attractive, so their omission is an error of one sign.
  // A wider cut-off therefore always has a smaller error.
  FieldModel chosen;
  choose_field(pair.a, pair.b, offset, chosen);
  EXPECT_FALSE(chosen.has_far_grid);
  const auto check_of = way_in(pair.a, pair.b, chosen, line_of_centres(offset));
  const WellCheck check = check_of(chosen);
  for (const double smaller : {8.0, 10.0, 12.0}) {
    if (smaller >= chosen.cutoff_angstrom) continue;
    FieldModel usual;
    usual.cutoff_angstrom = smaller;
    const WellCheck other = check_of(usual);
    EXPECT_FALSE(other.is_kept()) << smaller;
    EXPECT_GE(other.error_kj_per_mol, check.error_kj_per_mol) << smaller;
  }
  EXPECT_GT(chosen.cutoff_angstrom, 8) << "8 A errs by " << check.error_kj_per_mol << " of " << check.well_kj_per_mol;
  EXPECT_EQ(well_note(check).starts_with("doubtful"), !check.is_kept());
}

TEST(MolecularScale, OfAllPairsOfALargePairComesFromAGridAndShowsProgress) {
  const ProteinPair pair(1'300, 1'000);
  const std::array<const Molecule*, 2> molecules{&pair.a, &pair.b};
  const std::array<Vec3, 2> centres{Vec3::Zero(), Vec3(0, 50, 0)};
  std::vector<double> done;
  std::array<double, 2> newtons{};
  for (const bool has_grid : {false, true}) {
    wire::MolecularField field;
    field.set_metres_per_angstrom(0.01);
    field.set_force_limit_n(20);
    done.clear();
    complete_molecular_scale(field, molecules, centres, model_4r(has_grid ? 8 : 0, has_grid),
                             [&](const std::string& what, double part) {
                               EXPECT_THAT(what, HasSubstr("1300 and 1000 atoms"));
                               done.push_back(part);
                             });
    newtons.at(has_grid ? 1 : 0) = field.newtons_per_kcal_per_mol_angstrom();
    ASSERT_GT(done.size(), 10U);
    EXPECT_TRUE(std::ranges::is_sorted(done));
    EXPECT_EQ(done.back(), 1);
  }
  EXPECT_EQ(newtons[0], newtons[1]);
}

TEST(DockingScene, OfALargePairIsTheSameFieldForSwappedRoles) {
  const std::string file = "/usr/share/pymol/data/demo/1tii.pdb";
  TANDEM_NEEDS_FILES(file, test::kOplsDirectory);
  const wire::MoleculeSource toxin = molecule_source(file + ":A,C", "build"),
                             ring = molecule_source(file + ":D,E,F,G,H", "build");
  const wire::MolecularField one = docking_scene(toxin, ring, {}).molecular_field(),
                             swapped = docking_scene(ring, toxin, {}).molecular_field();
  EXPECT_TRUE(one.far_grid());
  EXPECT_TRUE(swapped.far_grid());
  EXPECT_EQ(one.cutoff_angstrom(), swapped.cutoff_angstrom());
}

}  // namespace
}  // namespace tandem::server
