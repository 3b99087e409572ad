// Tests charges and the cut-off: against closed forms, with gradients by finite differences, and the single-precision
// kernels against the exact field.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "tests/support/molecules.hpp"

namespace tandem::docking {
namespace {

constexpr unsigned kSeed = 20250611;

Molecule ion(double charge_e) {
  Molecule molecule = test::one_atom(0, 0);
  molecule.charge_e = {charge_e};
  return molecule;
}

/// Returns random atoms with the density of a protein (11 Å³ per atom) and charges between −0.6 and 0.6 e.
Molecule charged_molecule(std::size_t count, std::mt19937& random) {
  Molecule molecule = test::random_molecule(count, random);
  std::uniform_real_distribution<double> charge(-0.6, 0.6);
  for (Vec3& position : molecule.positions_angstrom) position *= 0.75;
  for (double& q : molecule.charge_e) q = charge(random);
  return molecule;
}

struct Pair {
  Molecule a, b;
  Pose X_AB;
};

Pair charged_pair(std::size_t count_a, std::size_t count_b, double gap_angstrom, std::mt19937& random) {
  Pair pair = {charged_molecule(count_a, random), charged_molecule(count_b, random), {}};
  pair.X_AB.q = test::random_rotation(random);
  double a_end = -1e9, b_begin = 1e9;
  for (const Vec3& p : pair.a.positions_angstrom) a_end = std::max(a_end, p.x());
  for (const Vec3& p : pair.b.positions_angstrom) b_begin = std::min(b_begin, (pair.X_AB * p).x());
  pair.X_AB.p = pair.a.centre_of_mass_angstrom() - pair.X_AB.q * pair.b.centre_of_mass_angstrom();
  pair.X_AB.p.x() = a_end - b_begin + gap_angstrom;
  return pair;
}

FieldModel model_of(Dielectric dielectric, double cutoff_angstrom = 0) {
  FieldModel model;
  model.dielectric = dielectric;
  model.cutoff_angstrom = cutoff_angstrom;
  return model;
}

double largest_norm(const std::vector<Vec3>& vectors) {
  double largest = 0;
  for (const Vec3& v : vectors) largest = std::max(largest, v.norm());
  return largest;
}

Pose moved(const Pose& X, const Vec3& by, const Vec3& turn) {
  return {X.p + by, quaternion_of(turn) * X.q};
}

/// Returns the derivative of a function of a length [Å] at 0, by a five-point central difference.
template <typename Function>
std::invoke_result_t<Function, double> derivative(const Function& f) {
  const double h = 1e-3;
  return (8.0 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12.0 * h);
}

TEST(Coulomb, TwoChargesFollowTheClosedForms) {
  for (const double r : {0.9, 2.0, 7.5}) {
    const Pose X_AB = {{0, 0, r}, Quat::Identity()};
    FieldModel model = model_of(Dielectric::kConstant);
    model.permittivity = 2;
    const FieldResult constant = exact_field(ion(0.5), ion(-0.4), X_AB, model);
    const double energy = -0.2 * 1389.35458 / (2 * r);
    EXPECT_NEAR(constant.coulomb_kj_per_mol, energy, 1e-12 * std::abs(energy));
    EXPECT_NEAR(constant.force_on_b.z(), energy / r, 1e-12 * std::abs(energy / r));
    EXPECT_EQ(constant.lennard_jones_kj_per_mol, 0);
    model = model_of(Dielectric::kDistance);
    const FieldResult growing = exact_field(ion(0.5), ion(-0.4), X_AB, model);
    const double screened = -0.2 * 1389.35458 / (4 * r * r);
    EXPECT_NEAR(growing.coulomb_kj_per_mol, screened, 1e-12 * std::abs(screened));
    EXPECT_NEAR(growing.force_on_b.z(), 2 * screened / r, 1e-12 * std::abs(screened));
  }
  EXPECT_EQ(exact_field(ion(1), ion(1), {{2, 0, 0}, Quat::Identity()}).energy_kj_per_mol(), 0);
}

TEST(Coulomb, AHydrogenOnAnOxygenPullsNoHarderThanAtTheClampAndStaysTheGradient) {
  for (const Dielectric dielectric : {Dielectric::kConstant, Dielectric::kDistance}) {
    const FieldModel model = model_of(dielectric);
    const auto at = [&](double r) { return exact_field(ion(0.4), ion(-0.7), {{r, 0, 0}, Quat::Identity()}, model); };
    for (const double r : {0.01, 0.4, 0.79, 0.81}) {
      const double gradient = -derivative([&](double s) { return at(r + s).coulomb_kj_per_mol; });
      EXPECT_NEAR(at(r).force_on_b.x(), gradient, 1e-7 * std::abs(gradient)) << r;
      EXPECT_LE(std::abs(at(r).force_on_b.x()), std::abs(at(0.8).force_on_b.x())) << r;
    }
    EXPECT_EQ(at(0).force_on_b, Vec3(Vec3::Zero()));
    EXPECT_TRUE(std::isfinite(at(0).coulomb_kj_per_mol));
  }
}

TEST(Cutoff, EnergyAndForceEndThereWithoutAStep) {
  for (const Dielectric dielectric : {Dielectric::kConstant, Dielectric::kDistance}) {
    Molecule atom = test::one_atom(3.5, 0.5);
    atom.charge_e = {0.5};
    const FieldModel model = model_of(dielectric, 8);
    const auto at = [&](double r) { return exact_field(atom, atom, {{r, 0, 0}, Quat::Identity()}, model); };
    EXPECT_EQ(at(8.001).energy_kj_per_mol(), 0);
    EXPECT_EQ(at(8.001).force_on_b, Vec3(Vec3::Zero()));
    EXPECT_NEAR(at(8 - 1e-4).energy_kj_per_mol(), 0, 1e-9);
    EXPECT_NEAR(at(8 - 1e-4).force_on_b.x(), 0, 1e-6);
    EXPECT_GT(at(7.5).force_on_b.x(), 1e-3);
    // Below the start of the switch, the force must equal that of a field without cut-off.
    const FieldResult whole = exact_field(atom, atom, {{5.9, 0, 0}, Quat::Identity()}, model_of(dielectric));
    EXPECT_NEAR(at(5.9).force_on_b.x(), whole.force_on_b.x(), 1e-12 * std::abs(whole.force_on_b.x()));
  }
}

TEST(Cutoff, OutOfRangeIsRefusedByName) {
  const Molecule atom = test::one_atom(3, 1);
  for (const double cutoff : {-1.0, 1.0, 101.0, std::nan("")}) {
    EXPECT_THROW(exact_field(atom, atom, Pose{}, model_of(Dielectric::kNone, cutoff)), std::invalid_argument);
    EXPECT_THROW(MolecularField(atom, atom, model_of(Dielectric::kNone, cutoff)), std::invalid_argument);
  }
  FieldModel model;
  model.permittivity = 0;
  try {
    validate(model);
    FAIL() << "a permittivity of 0 was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("permittivity"), std::string::npos);
  }
}

/// Fixture for all combinations of dielectric, cut-off (with or without) and mixing rule.
class Model : public testing::TestWithParam<std::tuple<Dielectric, double, bool>> {
 protected:
  static FieldModel model() { return model_of(std::get<0>(GetParam()), std::get<1>(GetParam())); }
  static bool is_arithmetic() { return std::get<2>(GetParam()); }
  static Pair mixing_pair(std::size_t count_a, std::size_t count_b, double gap_angstrom, std::mt19937& random) {
    Pair pair = charged_pair(count_a, count_b, gap_angstrom, random);
    pair.a.mixes_arithmetically = pair.b.mixes_arithmetically = is_arithmetic();
    return pair;
  }
};

INSTANTIATE_TEST_SUITE_P(Every, Model,
                         testing::Combine(testing::Values(Dielectric::kNone, Dielectric::kConstant,
                                                          Dielectric::kDistance),
                                          testing::Values(0.0, 8.0), testing::Bool()));

TEST_P(Model, ForceAndTorqueAreTheGradientOfTheEnergy) {
  std::mt19937 random(kSeed);
  for (const double gap : {1.2, 2.5, 6.0}) {
    const Pair pair = mixing_pair(80, 60, gap, random);
    const FieldResult result = exact_field(pair.a, pair.b, pair.X_AB, model());
    const auto energy = [&](const Vec3& by, const Vec3& turn) {
      return exact_field(pair.a, pair.b, moved(pair.X_AB, by, turn), model()).energy_kj_per_mol();
    };
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 e = Vec3::Unit(axis);
      const double force = -derivative([&](double s) { return energy(s * e, Vec3::Zero()); });
      const double torque = -derivative([&](double s) { return energy(Vec3::Zero(), 0.1 * s * e); });
      EXPECT_NEAR(result.force_on_b[axis], force, 1e-6 * result.force_on_b.norm()) << "gap " << gap;
      EXPECT_NEAR(0.1 * result.torque_on_b[axis], torque, 1e-6 * result.torque_on_b.norm()) << "gap " << gap;
    }
  }
}

TEST_P(Model, TheSixBySixGradientIsThatOfForceAndTorque) {
  std::mt19937 random(kSeed);
  const Pair pair = mixing_pair(80, 60, 1.5, random);
  Matrix6 gradient;
  exact_field(pair.a, pair.b, pair.X_AB, model(), {nullptr, nullptr, &gradient});
  for (int column = 0; column < 6; ++column) {
    const auto wrench = [&](double s) {
      const Vec3 by = column < 3 ? Vec3(s * Vec3::Unit(column)) : Vec3(Vec3::Zero());
      const Vec3 turn = column < 3 ? Vec3(Vec3::Zero()) : Vec3(0.1 * s * Vec3::Unit(column - 3));
      const FieldResult result = exact_field(pair.a, pair.b, moved(pair.X_AB, by, turn), model());
      Eigen::Matrix<double, 6, 1> both;
      both << result.force_on_b, result.torque_on_b;
      return both;
    };
    const Eigen::Matrix<double, 6, 1> expected = derivative(wrench) / (column < 3 ? 1.0 : 0.1);
    EXPECT_LT((gradient.col(column) - expected).norm(), 1e-6 * gradient.norm()) << "column " << column;
  }
}

TEST_P(Model, KernelsAgreeWithTheExactField) {
  std::mt19937 random(kSeed);
  for (const std::size_t count : {1UL, 16UL, 17UL, 130UL, 1500UL}) {
    for (const double gap : {-3.0, 0.3, 2.0, 5.0}) {
      const Pair pair = mixing_pair(count, 70, gap, random);
      std::vector<Vec3> on_b;
      const FieldResult exact = exact_field(pair.a, pair.b, pair.X_AB, model(), {nullptr, &on_b});
      const double largest = std::max(largest_norm(on_b), 1e-6);
      const double energy_scale = std::max(std::abs(exact.energy_kj_per_mol()), largest);
      double reach = 0;
      for (const Vec3& p : pair.b.positions_angstrom) reach = std::max(reach, p.norm());
      for (const std::string_view kernel : MolecularField::available_kernels()) {
        const FieldResult result = MolecularField(pair.a, pair.b, model(), kernel).evaluate(pair.X_AB);
        // The bound is larger for nearly overlapping atoms. Their force is so steep that a rounding error of 1e-6 in a
        // single-precision distance causes a large relative error.
        const double bound = gap < 1 ? 1e-4 : 1e-5;
        EXPECT_NEAR(result.lennard_jones_kj_per_mol, exact.lennard_jones_kj_per_mol, bound * energy_scale)
            << kernel << " " << count << " gap " << gap;
        EXPECT_NEAR(result.coulomb_kj_per_mol, exact.coulomb_kj_per_mol, bound * energy_scale)
            << kernel << " " << count << " gap " << gap;
        EXPECT_LT((result.force_on_b - exact.force_on_b).norm(), bound * largest)
            << kernel << " " << count << " gap " << gap;
        EXPECT_LT((result.torque_on_b - exact.torque_on_b).norm(), bound * largest * reach)
            << kernel << " " << count << " gap " << gap;
      }
    }
  }
}

TEST_P(Model, CoincidentAtomsStayFiniteInEveryKernel) {
  Molecule atom = test::one_atom(3, 1e4);
  atom.charge_e = {1};
  atom.mixes_arithmetically = is_arithmetic();
  Molecule hydrogen = test::one_atom(0, 0);
  hydrogen.charge_e = {-1};
  for (const std::string_view kernel : MolecularField::available_kernels()) {
    for (const Molecule* b : {&atom, &hydrogen}) {
      MolecularField field(atom, *b, model(), kernel);
      for (const double x : {0.0, 1e-30, 1e-12, 1e-3, 1e3, 1e6, 9e8}) {
        const FieldResult result = field.evaluate({{x, 0, 0}, Quat::Identity()});
        EXPECT_TRUE(std::isfinite(result.energy_kj_per_mol()) && is_finite(result.force_on_b)) << kernel << " " << x;
      }
    }
  }
}

TEST_P(Model, TheAnswerDependsOnThePoseAlone) {
  std::mt19937 random(kSeed);
  const Pair pair = mixing_pair(900, 400, 2.0, random);
  for (const std::string_view kernel : MolecularField::available_kernels()) {
    MolecularField one(pair.a, pair.b, model(), kernel), other(pair.a, pair.b, model(), kernel);
    const FieldResult first = one.evaluate(pair.X_AB);
    other.evaluate(moved(pair.X_AB, {3, 1, -2}, {0.3, 0, 0}));
    const FieldResult second = other.evaluate(pair.X_AB);
    EXPECT_EQ(first.energy_kj_per_mol(), second.energy_kj_per_mol());
    EXPECT_EQ(first.torque_on_b, second.torque_on_b);
  }
}

/// Assigns names, with `per_residue` atoms to each residue; residues are numbered from 1.
void name_residues(Molecule& molecule, std::size_t per_residue) {
  const std::size_t count = molecule.size();
  molecule.atom_names.assign(count, "C");
  molecule.elements.assign(count, "C");
  molecule.residue_names.assign(count, "LIG");
  molecule.chains.assign(count, "A");
  molecule.segments.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) molecule.residue_ids.push_back(std::to_string(1 + i / per_residue));
}

Eigen::Vector2d sum_of(const std::vector<Eigen::Vector2d>& energies) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& energy : energies) sum += energy;
  return sum;
}

TEST(ResidueEnergies, OfTwoResiduesFollowTheClosedForm) {
  Molecule a = test::one_atom(3, 0.5);
  const Molecule other = test::one_atom(3, 0.5, {0, 6, 0});
  a.positions_angstrom.push_back(other.positions_angstrom[0]);
  for (std::vector<double>* values : {&a.sigma_angstrom, &a.epsilon_kj_per_mol, &a.mass_u}) {
    values->push_back(values->front());
  }
  a.charge_e = {0.25, -0.5};
  name_residues(a, 1);
  Molecule b = test::one_atom(3, 0.5);
  b.charge_e = {0.5};
  name_residues(b, 1);
  std::vector<Eigen::Vector2d> of_a, of_b;
  ExactDetails details;
  details.energies_of_a = &of_a;
  details.energies_of_b = &of_b;
  const FieldModel model = model_of(Dielectric::kConstant);
  exact_field(a, b, {{4, 0, 0}, Quat::Identity()}, model, details);
  const std::vector<Eigen::Vector2d> residues = residue_energies(a, of_a);
  ASSERT_EQ(residues.size(), 2U);
  const auto expected = [&model](double charge2, double r) {
    const double p6 = std::pow(3 / r, 6);
    return Eigen::Vector2d(4 * 0.5 * (p6 * p6 - p6), kCoulombKjAngstromPerMol * charge2 / (model.permittivity * r));
  };
  const Eigen::Vector2d near = expected(0.125, 4), far = expected(-0.25, std::hypot(4.0, 6.0));
  EXPECT_LT((residues[0] - near).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((residues[1] - far).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((residue_energies(b, of_b).front() - near - far).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ResidueEnergies, OfEitherMoleculeSumToTheWhole) {
  std::mt19937 random(kSeed);
  for (const double cutoff : {0.0, 8.0}) {
    Pair pair = charged_pair(200, 150, 2.5, random);
    name_residues(pair.a, 7);
    name_residues(pair.b, 11);
    std::vector<Eigen::Vector2d> of_a, of_b;
    ExactDetails details;
    details.energies_of_a = &of_a;
    details.energies_of_b = &of_b;
    const FieldModel model = model_of(Dielectric::kDistance, cutoff);
    const FieldResult result = exact_field(pair.a, pair.b, pair.X_AB, model, details);
    const Eigen::Vector2d whole(result.lennard_jones_kj_per_mol, result.coulomb_kj_per_mol);
    const std::vector<Eigen::Vector2d> residues_a = residue_energies(pair.a, of_a);
    const std::vector<Eigen::Vector2d> residues_b = residue_energies(pair.b, of_b);
    EXPECT_EQ(residues_a.size(), 29U);
    EXPECT_EQ(residues_b.size(), 14U);
    for (int term = 0; term < 2; ++term) {
      EXPECT_NEAR(sum_of(residues_a)[term], whole[term], 1e-9 * std::abs(whole[term]));
      EXPECT_NEAR(sum_of(residues_b)[term], whole[term], 1e-9 * std::abs(whole[term]));
    }
    EXPECT_EQ(exact_field(pair.a, pair.b, pair.X_AB, model).energy_kj_per_mol(), result.energy_kj_per_mol());
  }
}

TEST(ResidueEnergies, BeginAResidueWhereNumberNameChainOrSegmentChange) {
  Molecule molecule;
  for (int i = 0; i < 6; ++i) molecule.positions_angstrom.emplace_back(i, 0, 0);
  name_residues(molecule, 6);
  molecule.residue_ids = {"1", "1A", "1A", "1A", "1A", "1A"};
  molecule.residue_names = {"GLY", "GLY", "ALA", "ALA", "ALA", "ALA"};
  molecule.chains = {"A", "A", "A", "B", "B", "B"};
  molecule.segments = {0, 0, 0, 0, 1, 1};
  EXPECT_EQ(residue_starts(molecule), (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  EXPECT_THROW(residue_energies(molecule, {}), std::invalid_argument);
  molecule.chains.pop_back();
  EXPECT_THROW(residue_starts(molecule), std::invalid_argument);
}

TEST(Clusters, ComputeFewPairsOfManyAndNoneFarAway) {
  std::mt19937 random(kSeed);
  const Pair pair = charged_pair(3000, 2000, 2.0, random);
  MolecularField field(pair.a, pair.b, model_of(Dielectric::kDistance, 8));
  EXPECT_EQ(field.method(), "clusters");
  field.evaluate(pair.X_AB);
  EXPECT_GT(field.pair_count(), 1000U);
  EXPECT_LT(field.pair_count(), 3000U * 2000U / 20);
  EXPECT_EQ(field.evaluate(moved(pair.X_AB, {40, 0, 0}, Vec3::Zero())).energy_kj_per_mol(), 0);
  EXPECT_EQ(field.pair_count(), 0U);
  EXPECT_EQ(MolecularField(pair.a, pair.b).method(), "all-pairs");
}

TEST(Clusters, AgreeWithTheExactFieldWhereALeafHasMoreNeighboursThanAreHeldAtOnce) {
  std::mt19937 random(kSeed);
  for (const double gap : {-8.0, 1.5}) {
    const Pair pair = charged_pair(4000, 50, gap, random);
    for (const Dielectric dielectric : {Dielectric::kConstant, Dielectric::kDistance}) {
      const FieldModel model = model_of(dielectric, 30);
      std::vector<Vec3> on_b;
      const FieldResult exact = exact_field(pair.a, pair.b, pair.X_AB, model, {nullptr, &on_b});
      const double largest = largest_norm(on_b);
      for (const std::string_view kernel : MolecularField::available_kernels()) {
        MolecularField field(pair.a, pair.b, model, kernel);
        const FieldResult result = field.evaluate(pair.X_AB);
        EXPECT_GT(field.pair_count(), 50U * 64 * 16) << "one list held them all";
        // For nearly overlapping atoms, a rounding error of 1e-6 in a single-precision distance causes a larger
        // relative error of the force.
        const double bound = gap < 0 ? 1e-4 : 1e-5;
        EXPECT_LT((result.force_on_b - exact.force_on_b).norm(), bound * largest) << kernel << " gap " << gap;
        EXPECT_NEAR(result.energy_kj_per_mol(), exact.energy_kj_per_mol(),
                    bound * std::max(std::abs(exact.energy_kj_per_mol()), largest))
            << kernel << " gap " << gap;
      }
    }
  }
}

TEST(Clusters, WorkWithoutAtoms) {
  const Molecule atom = test::one_atom(3.0, 1.0);
  EXPECT_EQ(MolecularField(Molecule(), atom, model_of(Dielectric::kNone, 8)).evaluate(Pose{}).energy_kj_per_mol(), 0);
  EXPECT_EQ(MolecularField(atom, Molecule(), model_of(Dielectric::kNone, 8)).evaluate(Pose{}).energy_kj_per_mol(), 0);
}

TEST(ExactField, OfManyPairsReportsProgress) {
  std::mt19937 random(kSeed);
  const Molecule a = test::random_molecule(3'000, random), b = test::random_molecule(7'000, random);
  std::vector<double> done;
  ExactDetails details;
  details.progress = [&done](double part) { done.push_back(part); };
  const FieldResult result = exact_field(a, b, {{80, 0, 0}, Quat::Identity()}, {}, details);
  ASSERT_EQ(done.size(), 3U);
  EXPECT_TRUE(std::ranges::is_sorted(done));
  EXPECT_EQ(done.back(), 1);
  EXPECT_EQ(result.energy_kj_per_mol(), exact_field(a, b, {{80, 0, 0}, Quat::Identity()}).energy_kj_per_mol());
}

TEST(ChooseCutoff, SumsAllPairsUpToAMillionAndUsesAGridAbove) {
  const auto chosen = [](std::size_t atoms_a, std::size_t atoms_b) {
    Molecule a, b;
    a.positions_angstrom.assign(atoms_a, Vec3::Zero());
    b.positions_angstrom.assign(atoms_b, Vec3::Zero());
    FieldModel model;
    choose_cutoff(a, b, model);
    validate(model);
    return std::pair(model.cutoff_angstrom, model.has_far_grid);
  };
  EXPECT_EQ(chosen(1000, 1000), std::pair(0.0, false));
  EXPECT_EQ(chosen(1001, 1000), std::pair(8.0, true));
  EXPECT_EQ(chosen(9517, 2983), std::pair(8.0, true));
  EXPECT_EQ(chosen(2983, 9517), std::pair(8.0, true));
  EXPECT_EQ(chosen(12'000, 11'000), std::pair(8.0, true));
  EXPECT_EQ(chosen(12'002, 12'001), std::pair(8.0, false)) << "too many atoms for look-ups in a grid";
  EXPECT_EQ(chosen(500'000, 1000), std::pair(8.0, false)) << "too large for a grid";
  EXPECT_EQ(chosen(1000, 500'000), std::pair(8.0, false)) << "too large for a grid";
}

}  // namespace
}  // namespace tandem::docking
