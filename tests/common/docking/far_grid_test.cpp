// Tests the far grid (interaction beyond the cut-off): its energy against the sum over all pairs, its force against the
// gradient of its energy, and its outer end.
#include "common/docking/far_grid.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "common/docking/molecular_field.hpp"
#include "tests/support/molecules.hpp"

namespace tandem::docking {
namespace {

constexpr unsigned kFarGridSeed = 20250611;

FieldModel model_of(Dielectric dielectric, double cutoff_angstrom, bool has_far_grid) {
  FieldModel model;
  model.dielectric = dielectric;
  model.permittivity = dielectric == Dielectric::kDistance ? 4 : 1;
  model.cutoff_angstrom = cutoff_angstrom;
  model.has_far_grid = has_far_grid;
  return model;
}

/// Returns charges around the origin with the density of a protein. Each is at most ±0.6 e, and their sum is not zero.
Molecule random_charges(std::size_t count, std::mt19937& random) {
  Molecule molecule = test::random_molecule(count, random);
  std::uniform_real_distribution<double> charge(-0.5, 0.6);
  const Vec3 centre = molecule.centre_of_mass_angstrom();
  for (Vec3& position : molecule.positions_angstrom) position = 0.75 * (position - centre);
  for (double& q : molecule.charge_e) q = charge(random);
  return molecule;
}

class FarGridOf : public testing::TestWithParam<Dielectric> {
 protected:
  std::mt19937 random_{kFarGridSeed};
  const Molecule a_ = random_charges(150, random_), b_ = random_charges(60, random_);
};

INSTANTIATE_TEST_SUITE_P(Every, FarGridOf,
                         testing::Values(Dielectric::kNone, Dielectric::kConstant, Dielectric::kDistance));

TEST_P(FarGridOf, AddsTheMissingForceOfAllPairsInEveryKernel) {
  for (const std::string_view kernel : MolecularField::available_kernels()) {
    MolecularField all(a_, b_, model_of(GetParam(), 0, false), kernel);
    MolecularField near(a_, b_, model_of(GetParam(), 8, false), kernel);
    MolecularField grid(a_, b_, model_of(GetParam(), 8, true), kernel);
    ASSERT_NE(grid.far_grid(), nullptr);
    EXPECT_EQ(grid.method(), "clusters and grid");
    // Measured error: 0.053 of the force beyond the cut-off. It is larger than for a protein, because forces of random
    // charges cancel each other more.
    double force = 0, force_error = 0, torque = 0, torque_error = 0, energy = 0, energy_error = 0;
    for (int i = 0; i < 24; ++i) {
      const Pose X_AB = {(20 + i % 8) * Vec3(0.6, 0.64, 0.48), test::random_rotation(random_)};
      const FieldResult exact = all.evaluate(X_AB), near_only = near.evaluate(X_AB), with = grid.evaluate(X_AB);
      force += (near_only.force_on_b - exact.force_on_b).squaredNorm();
      force_error += (with.force_on_b - exact.force_on_b).squaredNorm();
      torque += (near_only.torque_on_b - exact.torque_on_b).squaredNorm();
      torque_error += (with.torque_on_b - exact.torque_on_b).squaredNorm();
      energy += std::pow(near_only.energy_kj_per_mol() - exact.energy_kj_per_mol(), 2);
      energy_error += std::pow(with.energy_kj_per_mol() - exact.energy_kj_per_mol(), 2);
    }
    EXPECT_LT(std::sqrt(force_error / force), 0.1) << kernel;
    EXPECT_LT(std::sqrt(torque_error / torque), 0.1) << kernel;
    EXPECT_LT(std::sqrt(energy_error / energy), 0.02) << kernel;
  }
}

TEST_P(FarGridOf, WorkIsTheEnergyLostAndNoneOnALoopAlsoThroughTheFadingEnd) {
  MolecularField field(a_, b_, model_of(GetParam(), 8, true));
  constexpr int kSteps = 6000;
  for (const double distance : {20.0, 42.0}) {
    double work = 0, absolute = 0, half = 0, last = 0;
    std::array<double, 2> energy{};
    for (int i = 0; i <= kSteps; ++i) {
      const double phase = 2 * std::numbers::pi * i / kSteps;
      const Vec3 p = distance * Vec3(0.6, 0.64, 0.48) + 4 * Vec3(std::cos(phase), std::sin(phase), std::sin(2 * phase));
      const Vec3 v = 4 * Vec3(-std::sin(phase), std::cos(phase), 2 * std::cos(2 * phase));
      const Vec3 axis(0.48, -0.6, 0.64);
      const FieldResult result = field.evaluate({p, quaternion_of(0.5 * std::sin(phase) * axis)});
      const double power = result.force_on_b.dot(v) + result.torque_on_b.dot(0.5 * std::cos(phase) * axis);
      if (i % (kSteps / 2) == 0 && i < kSteps) energy[i == 0 ? 0 : 1] = result.energy_kj_per_mol();
      if (i > 0) {
        const double step = std::numbers::pi / kSteps * (last + power);
        work += step;
        absolute += std::abs(step);
      }
      if (i == kSteps / 2) half = work;
      last = power;
    }
    EXPECT_GT(absolute, 0);
    EXPECT_LT(std::abs(work), 1e-6 * absolute) << distance;
    // Both energies are sums in single precision. At 42 Å their measured rounding error is 0.9e-6 of the work, for any
    // number of steps.
    EXPECT_NEAR(half, energy[0] - energy[1], 2e-6 * absolute) << distance;
  }
}

TEST(FarGrid, OfOneIonIsCoulombsLawBeyondTheCutOffAndEndsByDesign) {
  Molecule ion = test::one_atom(0, 0);
  ion.charge_e = {1};
  MolecularField field(ion, ion, model_of(Dielectric::kConstant, 8, true));
  for (const double r : {9.0, 15.5, 27.0}) {
    const FieldResult result = field.evaluate({{0, r, 0}, Quat::Identity()});
    const double energy = kCoulombKjAngstromPerMol / r;
    EXPECT_NEAR(result.coulomb_kj_per_mol, energy, 2e-3 * energy) << r;
    // At r = 9 Å, the tolerance is larger. The switch function ends close by at 8 Å, and its width of 2 Å is only two
    // spacings of the grid.
    EXPECT_NEAR(result.force_on_b.y(), energy / r, (r < 10 ? 5e-2 : 5e-3) * energy / r) << r;
  }
  EXPECT_EQ(field.evaluate({{0, kFarReachAngstrom + 2, 0}, Quat::Identity()}).energy_kj_per_mol(), 0);
  EXPECT_EQ(field.evaluate({{1e9, -1e9, 1e9}, Quat::Identity()}).energy_kj_per_mol(), 0);
}

TEST(FarGrid, OfOneMoleculeAndModelIsMadeOnce) {
  const Molecule a = test::one_atom(3, 0.7), b = test::one_atom(3, 0.5), c = test::one_atom(3, 0.9);
  const FieldModel model = model_of(Dielectric::kNone, 8, true);
  const MolecularField field(a, b, model), again(b, a, model);
  const MolecularField other(c, a, model), wider(a, b, model_of(Dielectric::kNone, 9, true));
  ASSERT_NE(field.far_grid(), nullptr);
  EXPECT_EQ(again.far_grid(), field.far_grid());
  EXPECT_NE(other.far_grid(), field.far_grid());
  EXPECT_NE(wider.far_grid(), field.far_grid());
}

TEST(FarGrid, IsNotBuiltForATooLargeMolecule) {
  Molecule pair = test::one_atom(3, 0.5);
  const Molecule one = pair;
  pair.positions_angstrom.emplace_back(900, 900, 900);
  for (std::vector<double>* values : {&pair.sigma_angstrom, &pair.epsilon_kj_per_mol, &pair.charge_e, &pair.mass_u}) {
    values->push_back(values->front());
  }
  const MolecularField field(pair, one, model_of(Dielectric::kNone, 8, true));
  EXPECT_EQ(field.far_grid(), nullptr);
  EXPECT_EQ(field.method(), "clusters");
}

TEST(FarGrid, NeedsACutOff) {
  const Molecule one = test::one_atom(3, 0.5);
  EXPECT_THROW(MolecularField(one, one, model_of(Dielectric::kNone, 0, true)), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::docking
