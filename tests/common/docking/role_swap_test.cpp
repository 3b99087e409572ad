// The field of two molecules must not depend on which of them is passed as A. Its energy well must agree with that of
// the sum over all pairs.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>

#include "common/docking/far_grid.hpp"
#include "common/docking/molecular_field.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::docking {
namespace {

constexpr unsigned kRoleSeed = 20261130;

double extent(const Molecule& molecule) {
  double radius = 0;
  for (const Vec3& place : molecule.positions_angstrom) radius = std::max(radius, place.norm());
  return radius;
}

FieldModel chosen_model(const Molecule& a, const Molecule& b) {
  FieldModel model;
  set_dielectric(model, "4r");
  choose_cutoff(a, b, model);
  return model;
}

constexpr std::array<std::pair<std::size_t, std::size_t>, 10> kSizes{{{500, 500},
                                                                      {700, 2'500},
                                                                      {1'000, 1'000},
                                                                      {1'856, 6'870},
                                                                      {3'845, 3'120},
                                                                      {5'000, 4'100},
                                                                      {900, 12'000},
                                                                      {4'000, 8'000},
                                                                      {4'500, 4'500},
                                                                      {12'000, 9'000}}};

class RoleSwap : public testing::TestWithParam<std::pair<std::size_t, std::size_t>> {
 protected:
  const std::uint64_t seed_ = test::test_seed(kRoleSeed);
  std::mt19937 random_{static_cast<unsigned>(seed_)};
  const Molecule a_ = test::protein_like(GetParam().first, 1, random_),
                 b_ = test::protein_like(GetParam().second, -1, random_);
  const FieldModel model_ = chosen_model(a_, b_);
};

INSTANTIATE_TEST_SUITE_P(Of, RoleSwap, testing::ValuesIn(kSizes), [](const auto& sizes) {
  return std::to_string(sizes.param.first) + "With" + std::to_string(sizes.param.second);
});

TEST_P(RoleSwap, GivesTheSameEnergyAndOppositeForces) {
  const FieldModel other = chosen_model(b_, a_);
  EXPECT_EQ(other, model_);
  MolecularField one(a_, b_, model_), swapped(b_, a_, model_);
  EXPECT_EQ(one.method(), swapped.method());
  EXPECT_EQ(one.far_grid(), swapped.far_grid());
  const double apart = extent(a_) + extent(b_);
  for (const double gap : {0.0, 2.0, 6.0}) {
    const Vec3 direction = (test::random_rotation(random_) * Vec3::UnitX()).normalized();
    const Pose X_AB{(apart + gap) * direction, test::random_rotation(random_)};
    const Pose X_BA = X_AB.inverse();
    const FieldResult on_b = one.evaluate(X_AB), on_a = swapped.evaluate(X_BA);
    const std::string where = "gap " + std::to_string(gap) + " A, seed " + std::to_string(seed_);
    EXPECT_NE(on_b.energy_kj_per_mol(), 0) << where;
    EXPECT_NEAR(on_b.energy_kj_per_mol(), on_a.energy_kj_per_mol(), 1e-9 * std::abs(on_b.energy_kj_per_mol())) << where;
    const Vec3 force_a = X_AB.q * on_a.force_on_b, torque_a = X_AB.q * on_a.torque_on_b;
    EXPECT_LT((on_b.force_on_b + force_a).norm(), 1e-7 * (1 + on_b.force_on_b.norm())) << where;
    // For the comparison both torques are taken about the origin of A.
    const Vec3 about_a = on_b.torque_on_b + X_AB.p.cross(on_b.force_on_b);
    EXPECT_LT((about_a + torque_a).norm(), 1e-7 * (1 + on_b.torque_on_b.norm() + about_a.norm())) << where;
  }
}

TEST_P(RoleSwap, KeepsTheWellOfAllPairsOnTheWayIn) {
  MolecularField all(a_, b_, [] {
    FieldModel model;
    set_dielectric(model, "4r");
    return model;
  }());
  MolecularField chosen(a_, b_, model_);
  const Quat q = test::random_rotation(random_);
  const Vec3 direction = (test::random_rotation(random_) * Vec3::UnitX()).normalized();
  const auto at = [&](double distance) { return Pose{distance * direction, q}; };
  double contact = extent(a_) + extent(b_) + 4;
  while (contact > 0 && chosen.evaluate(at(contact - 0.25)).lennard_jones_kj_per_mol < 0) contact -= 0.25;
  double well = 0, error = 0;
  for (const double out : {0.0, 0.5, 1.0, 2.0, 3.5, 5.0, 8.0, 12.0}) {
    const double energy = all.evaluate(at(contact + out)).energy_kj_per_mol();
    well = std::min(well, energy);
    error = std::max(error, std::abs(chosen.evaluate(at(contact + out)).energy_kj_per_mol() - energy));
  }
  EXPECT_LT(well, 0) << "seed " << seed_;
  // The tolerance is 5 % of the depth of the energy minimum (well). A depth below 20 kJ/mol (8 kT) counts as 20 kJ/mol.
  // Some random molecules are spherical and touch at one point only, so their attraction is weak.
  EXPECT_LT(error, 0.05 * std::max(20.0, -well)) << "well " << well << " kJ/mol, seed " << seed_;
  RecordProperty("error_per_mille", static_cast<int>(std::lround(1000 * error / -well)));
}

/// Detects an order of two molecules of equal size that depends on the order of the arguments.
TEST(ComesFirst, OrdersTwoDifferentMoleculesOfOneSize) {
  std::mt19937 random(kRoleSeed);
  const Molecule a = test::protein_like(100, 1, random);
  Molecule b = a;
  EXPECT_FALSE(comes_first(a, b));
  EXPECT_FALSE(comes_first(b, a));
  b.positions_angstrom.back().z() += 1e-9;
  EXPECT_NE(comes_first(a, b), comes_first(b, a));
  b.charge_e.front() += 1e-9;
  EXPECT_NE(comes_first(a, b), comes_first(b, a));
}

}  // namespace
}  // namespace tandem::docking
