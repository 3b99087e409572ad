// Compares the Lennard-Jones interaction with its closed form, its gradient and its symmetries, and the
// single-precision kernels with the double-precision field.
#include "common/docking/molecule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"

namespace tandem::docking {
namespace {

using test::one_atom;
using test::random_molecule;
using test::random_rotation;

constexpr unsigned kMoleculeSeed = 20240607;

struct MoleculePair {
  Molecule a;
  Molecule b;
  Pose X_AB;
};

Vec3 centroid(const std::vector<Vec3>& points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Returns two random molecules side by side. Their outermost atoms are `gap_angstrom` apart along x, and B has a
/// random orientation.
MoleculePair random_pair(std::size_t count_a, std::size_t count_b, double gap_angstrom, std::mt19937& random) {
  MoleculePair pair = {test::random_molecule(count_a, random), test::random_molecule(count_b, random), {}};
  pair.X_AB.q = test::random_rotation(random);
  pair.X_AB.p = centroid(pair.a.positions_angstrom) - pair.X_AB.q * centroid(pair.b.positions_angstrom);
  double a_end = -1e9;
  double b_begin = 1e9;
  for (const Vec3& p : pair.a.positions_angstrom) a_end = std::max(a_end, p.x());
  for (const Vec3& p : pair.b.positions_angstrom) b_begin = std::min(b_begin, (pair.X_AB * p).x());
  pair.X_AB.p.x() += a_end - b_begin + gap_angstrom;
  return pair;
}

double longest(const std::vector<Vec3>& vectors) {
  double largest = 0;
  for (const Vec3& v : vectors) largest = std::max(largest, v.norm());
  return largest;
}

double energy_at(const MoleculePair& pair, const Pose& X_AB) {
  return exact_field(pair.a, pair.b, X_AB).energy_kj_per_mol();
}

/// Returns the derivative of `f` at 0 by a five-point central difference. Its error is of order h⁴, below 1e-8 for h =
/// 1e-3 Å.
template <typename Function>
double numerical_derivative(const Function& f) {
  const double h = 1e-3;
  return (8.0 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12.0 * h);
}

TEST(LennardJones, TwoAtomsFollowTheClosedForm) {
  const double sigma = 3.5;
  const double epsilon = 0.7;
  for (const double reduced : {0.9, 1.0, 1.1225, 2.0}) {
    const double r = reduced * sigma;
    const double p6 = std::pow(sigma / r, 6);
    const double energy = 4 * epsilon * (p6 * p6 - p6);
    const double force = 4 * epsilon * (12 * p6 * p6 - 6 * p6) / r;
    std::vector<Vec3> on_a;
    const FieldResult result = exact_field(test::one_atom(sigma, epsilon), test::one_atom(sigma, epsilon),
                                           {{0, r, 0}, Quat::Identity()}, {}, {&on_a});
    EXPECT_NEAR(result.energy_kj_per_mol(), energy, 1e-13) << "at " << reduced << " sigma";
    EXPECT_NEAR(result.force_on_b.y(), force, 1e-12 * std::max(1.0, std::abs(force))) << "at " << reduced << " sigma";
    EXPECT_EQ(on_a[0], -result.force_on_b);
  }
}

TEST(LennardJones, MixesGeometrically) {
  const FieldResult mixed =
      exact_field(test::one_atom(2.0, 0.1), test::one_atom(8.0, 0.9), {{5, 0, 0}, Quat::Identity()});
  const FieldResult same =
      exact_field(test::one_atom(4.0, 0.3), test::one_atom(4.0, 0.3), {{5, 0, 0}, Quat::Identity()});
  EXPECT_NEAR(mixed.energy_kj_per_mol(), same.energy_kj_per_mol(), 1e-15);
  EXPECT_NEAR(mixed.force_on_b.x(), same.force_on_b.x(), 1e-14);
}

TEST(LennardJones, MixesArithmeticallyWhereEitherMoleculeDoes) {
  Molecule small = test::one_atom(2.0, 0.1), large = test::one_atom(8.0, 0.9),
           polar_hydrogen = test::one_atom(0.0, 0.2);
  const Molecule mean = test::one_atom(5.0, 0.3);
  large.mixes_arithmetically = true;
  for (const double r : {0.5, 4.0, 7.0}) {
    const Pose X_AB = {{r, 0, 0}, Quat::Identity()};
    const FieldResult same = exact_field(mean, mean, X_AB);
    for (const FieldResult& mixed : {exact_field(small, large, X_AB), exact_field(large, small, X_AB)}) {
      EXPECT_NEAR(mixed.energy_kj_per_mol(), same.energy_kj_per_mol(), 1e-14 * std::abs(same.energy_kj_per_mol())) << r;
      EXPECT_NEAR(mixed.force_on_b.x(), same.force_on_b.x(), 1e-14 * std::abs(same.force_on_b.x())) << r;
    }
    EXPECT_EQ(exact_field(large, polar_hydrogen, X_AB).energy_kj_per_mol(), 0) << "no size, no term";
    EXPECT_EQ(MolecularField(large, polar_hydrogen).evaluate(X_AB).energy_kj_per_mol(), 0);
  }
}

TEST(LennardJones, ForceAndTorqueAreTheGradientOfTheEnergy) {
  std::mt19937 random(kMoleculeSeed);
  for (const double gap : {1.5, 2.5, 6.0}) {
    const MoleculePair pair = random_pair(40, 30, gap, random);
    const FieldResult result = exact_field(pair.a, pair.b, pair.X_AB);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 e = Vec3::Unit(axis);
      const double force = -numerical_derivative([&](double s) {
        return energy_at(pair, {pair.X_AB.p + s * e, pair.X_AB.q});
      });
      const double torque = -numerical_derivative([&](double s) {
        return energy_at(pair, {pair.X_AB.p, quaternion_of(0.1 * s * e) * pair.X_AB.q});
      });
      EXPECT_NEAR(result.force_on_b[axis], force, 1e-7 * result.force_on_b.norm()) << "gap " << gap;
      EXPECT_NEAR(0.1 * result.torque_on_b[axis], torque, 1e-7 * result.torque_on_b.norm()) << "gap " << gap;
    }
  }
}

TEST(LennardJones, DoesNotDependOnTheCommonPose) {
  std::mt19937 random(kMoleculeSeed);
  const MoleculePair pair = random_pair(50, 40, 2.5, random);
  const FieldResult before = exact_field(pair.a, pair.b, pair.X_AB);
  const Pose moved = {{12, -7, 30}, test::random_rotation(random)};
  MoleculePair other = pair;
  for (Vec3& p : other.a.positions_angstrom) p = moved * p;
  const FieldResult after = exact_field(other.a, other.b, moved * pair.X_AB);
  EXPECT_NEAR(after.energy_kj_per_mol(), before.energy_kj_per_mol(), 1e-10 * std::abs(before.energy_kj_per_mol()));
  EXPECT_LT((after.force_on_b - moved.q * before.force_on_b).norm(), 1e-10 * before.force_on_b.norm());
  EXPECT_LT((after.torque_on_b - moved.q * before.torque_on_b).norm(), 1e-10 * before.torque_on_b.norm());
}

TEST(LennardJones, ForcesAndTorquesOfBothMoleculesSumToZero) {
  std::mt19937 random(kMoleculeSeed);
  const MoleculePair pair = random_pair(60, 45, 2.0, random);
  std::vector<Vec3> on_a;
  std::vector<Vec3> on_b;
  exact_field(pair.a, pair.b, pair.X_AB, {}, {&on_a, &on_b});
  const double scale = std::max(longest(on_a), longest(on_b));
  Vec3 force = Vec3::Zero();
  Vec3 torque = Vec3::Zero();
  for (std::size_t i = 0; i < on_a.size(); ++i) {
    force += on_a[i];
    torque += pair.a.positions_angstrom[i].cross(on_a[i]);
  }
  for (std::size_t j = 0; j < on_b.size(); ++j) {
    force += on_b[j];
    torque += (pair.X_AB * pair.b.positions_angstrom[j]).cross(on_b[j]);
  }
  EXPECT_GT(scale, 0.1);
  EXPECT_LT(force.norm(), 1e-12 * scale);
  EXPECT_LT(torque.norm(), 1e-11 * scale);
}

TEST(LennardJones, ExchangingTheMoleculesTurnsTheForceRound) {
  std::mt19937 random(kMoleculeSeed);
  const MoleculePair pair = random_pair(30, 50, 2.0, random);
  const FieldResult ab = exact_field(pair.a, pair.b, pair.X_AB);
  const FieldResult ba = exact_field(pair.b, pair.a, pair.X_AB.inverse());
  EXPECT_NEAR(ba.energy_kj_per_mol(), ab.energy_kj_per_mol(), 1e-11 * std::abs(ab.energy_kj_per_mol()));
  EXPECT_LT((pair.X_AB.q * ba.force_on_b + ab.force_on_b).norm(), 1e-10 * ab.force_on_b.norm());
}

TEST(LennardJones, AtomsWithoutParametersAreNotFelt) {
  Molecule a = test::one_atom(3.5, 0.5);
  const Molecule polar_hydrogen = test::one_atom(0.0, 0.0);
  for (const double x : {0.0, 1.0, 4.0}) {
    const Pose X_AB = {{x, 0, 0}, Quat::Identity()};
    EXPECT_EQ(exact_field(a, polar_hydrogen, X_AB).energy_kj_per_mol(), 0.0);
    EXPECT_EQ(MolecularField(polar_hydrogen, a).evaluate(X_AB).force_on_b, Vec3(Vec3::Zero()));
  }
  EXPECT_EQ(MolecularField(a, polar_hydrogen).pair_count(), 0U);
}

TEST(LennardJones, OverlapGivesAHugeFiniteForceThatStaysTheGradient) {
  const double sigma = 3.0;
  const double core = sigma / 4;
  const MoleculePair pair = {test::one_atom(sigma, 1.0), test::one_atom(sigma, 1.0), {}};
  const auto at = [&](double r) { return exact_field(pair.a, pair.b, {{r, 0, 0}, Quat::Identity()}); };
  for (const double r : {0.01, 0.3, core - 0.01, core + 0.01}) {
    const double gradient = -numerical_derivative([&](double s) { return at(r + s).energy_kj_per_mol(); });
    EXPECT_NEAR(at(r).force_on_b.x(), gradient, 1e-7 * gradient) << "r = " << r;
    EXPECT_GT(at(r).force_on_b.x(), 1e6) << "r = " << r;
  }
  EXPECT_NEAR(at(core - 1e-9).force_on_b.x() / at(core + 1e-9).force_on_b.x(), 1.0, 1e-7);
  EXPECT_GT(at(0).energy_kj_per_mol(), at(core).energy_kj_per_mol());
  EXPECT_TRUE(std::isfinite(at(0).energy_kj_per_mol()));
  EXPECT_EQ(at(0).force_on_b, Vec3(Vec3::Zero()));
}

TEST(LennardJones, APoseThatIsNoPoseGivesZeros) {
  const Molecule atom = test::one_atom(3.0, 1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  MolecularField field(atom, atom);
  for (const Pose& X_AB : {Pose{{nan, 0, 0}, Quat::Identity()}, Pose{{0, infinity, 0}, Quat::Identity()},
                           Pose{{1e300, 0, 0}, Quat::Identity()}, Pose{{3, 0, 0}, Quat(0, 0, 0, 0)},
                           Pose{{3, 0, 0}, Quat(1e200, 0, 0, 0)}, Pose{{3, 0, 0}, Quat(nan, 0, 0, 0)}}) {
    EXPECT_EQ(exact_field(atom, atom, X_AB).energy_kj_per_mol(), 0.0);
    EXPECT_EQ(field.evaluate(X_AB).energy_kj_per_mol(), 0.0);
    EXPECT_EQ(field.evaluate(X_AB).torque_on_b, Vec3(Vec3::Zero()));
  }
}

TEST(LennardJones, RefusesParametersThatItCannotBound) {
  const Molecule good = test::one_atom(3.0, 1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Molecule unequal = good;
  unequal.sigma_angstrom.push_back(1.0);
  for (const Molecule& bad : {test::one_atom(1e-9, 1.0), test::one_atom(21.0, 1.0), test::one_atom(nan, 1.0),
                              test::one_atom(3.0, -1.0), test::one_atom(3.0, nan),
                              test::one_atom(3.0, 1.0, {nan, 0, 0}), test::one_atom(3.0, 1.0, {2e6, 0, 0}), unequal}) {
    EXPECT_THROW(MolecularField(good, bad), std::invalid_argument);
    EXPECT_THROW(exact_field(bad, good, Pose{}), std::invalid_argument);
  }
}

TEST(Molecule, CentreOfMassWeighsByMass) {
  Molecule molecule = test::one_atom(3, 1, {1, 0, 0});
  EXPECT_EQ(Molecule().centre_of_mass_angstrom(), Vec3(Vec3::Zero()));
  molecule.positions_angstrom.emplace_back(4, 0, 3);
  molecule.mass_u.push_back(24);
  EXPECT_LT((molecule.centre_of_mass_angstrom() - Vec3(3, 0, 2)).norm(), 1e-15);
  const Vec3 first = molecule.positions_angstrom.front();
  EXPECT_LT((molecule.centre() - Vec3(3, 0, 2)).norm(), 1e-15);
  EXPECT_LT((molecule.positions_angstrom.front() - (first - Vec3(3, 0, 2))).norm(), 1e-15);
  EXPECT_LT(molecule.centre_of_mass_angstrom().norm(), 1e-15);
  molecule.positions_angstrom = {{3, 0, 0}, {0, -3, 0}};
  EXPECT_NEAR(molecule.gyration_radius_angstrom(), 3, 1e-15);
  molecule.positions_angstrom = {{0, 0, 0}};
  EXPECT_EQ(molecule.gyration_radius_angstrom(), 1);
}

/// Fixture for requirements on every kernel that this processor can run.
class Kernel : public testing::TestWithParam<std::string_view> {};

INSTANTIATE_TEST_SUITE_P(LennardJones, Kernel, testing::ValuesIn(MolecularField::available_kernels()),
                         [](const auto& kernel) { return std::string(kernel.param); });

TEST_P(Kernel, AgreesWithDoubleAtomByAtom) {
  std::mt19937 random(kMoleculeSeed);
  for (const double gap : {1.0, 2.0, 4.0, 20.0}) {
    const MoleculePair pair = random_pair(301, 37, gap, random);
    std::vector<Vec3> exact;
    exact_field(pair.a, pair.b, pair.X_AB, {}, {nullptr, &exact});
    const double largest = longest(exact);
    for (std::size_t j = 0; j < pair.b.size(); ++j) {
      const Molecule atom =
          test::one_atom(pair.b.sigma_angstrom[j], pair.b.epsilon_kj_per_mol[j], pair.b.positions_angstrom[j]);
      const Vec3 force = MolecularField(pair.a, atom, {}, GetParam()).evaluate(pair.X_AB).force_on_b;
      EXPECT_LT((force - exact[j]).norm(), 1e-5 * largest)
          << "atom " << j << ", gap " << gap << ", seed " << kMoleculeSeed;
    }
  }
}

TEST_P(Kernel, AgreesWithDoubleForEveryPaddingAndBeyondOneDrain) {
  std::mt19937 random(kMoleculeSeed);
  for (const std::size_t count : {1, 15, 16, 17, 63, 64, 65, 1023, 1025, 2100}) {
    const MoleculePair pair = random_pair(count, 23, 2.0, random);
    std::vector<Vec3> on_b;
    const FieldResult exact = exact_field(pair.a, pair.b, pair.X_AB, {}, {nullptr, &on_b});
    const FieldResult result = MolecularField(pair.a, pair.b, {}, GetParam()).evaluate(pair.X_AB);
    const double largest = std::max(longest(on_b), 1e-6);
    // Scale of the energy's error: a position error changes the energy by force × error. Because repulsion and
    // attraction almost cancel in the energy, the scale is at least the largest force × 1 Å.
    const double energy_scale = std::max(std::abs(exact.energy_kj_per_mol()), largest);
    double reach = 0;
    for (const Vec3& p : pair.b.positions_angstrom) reach = std::max(reach, p.norm());
    EXPECT_NEAR(result.energy_kj_per_mol(), exact.energy_kj_per_mol(), 1e-5 * energy_scale) << count;
    EXPECT_LT((result.force_on_b - exact.force_on_b).norm(), 1e-5 * largest) << count;
    EXPECT_LT((result.torque_on_b - exact.torque_on_b).norm(), 1e-5 * largest * reach) << count;
  }
}

TEST_P(Kernel, LosesNothingFarFromTheOrigin) {
  std::mt19937 random(kMoleculeSeed);
  MoleculePair pair = random_pair(200, 60, 2.0, random);
  const Vec3 away(4000, -3000, 5000);
  for (Vec3& p : pair.a.positions_angstrom) p += away;
  pair.X_AB.p += away;
  for (const double cutoff : {0.0, kUsualCutoffAngstrom}) {
    FieldModel model;
    model.cutoff_angstrom = cutoff;
    std::vector<Vec3> on_b;
    const FieldResult exact = exact_field(pair.a, pair.b, pair.X_AB, model, {nullptr, &on_b});
    const FieldResult result = MolecularField(pair.a, pair.b, model, GetParam()).evaluate(pair.X_AB);
    EXPECT_LT((result.force_on_b - exact.force_on_b).norm(), 1e-5 * longest(on_b)) << cutoff;
    EXPECT_NEAR(result.energy_kj_per_mol(), exact.energy_kj_per_mol(), 1e-5 * std::abs(exact.energy_kj_per_mol()))
        << cutoff;
  }
}

TEST_P(Kernel, StaysFiniteAndCloseToDoubleInOverlap) {
  std::mt19937 random(kMoleculeSeed);
  const MoleculePair pair = random_pair(100, 100, -8.0, random);
  const FieldResult exact = exact_field(pair.a, pair.b, pair.X_AB);
  MolecularField field(pair.a, pair.b, {}, GetParam());
  const FieldResult result = field.evaluate(pair.X_AB);
  EXPECT_GT(exact.force_on_b.norm(), 1e6);
  EXPECT_LT((result.force_on_b - exact.force_on_b).norm(), 1e-4 * exact.force_on_b.norm());
  EXPECT_NEAR(result.energy_kj_per_mol(), exact.energy_kj_per_mol(), 1e-4 * exact.energy_kj_per_mol());
}

TEST_P(Kernel, StaysFiniteForCoincidentAndForFarAwayAtoms) {
  for (const double sigma : {0.1, 3.0, 20.0}) {
    const Molecule atom = test::one_atom(sigma, 1e4);
    MolecularField field(atom, atom, {}, GetParam());
    for (const double x : {0.0, 1e-30, 1e-12, 1e-3, 1e3, 1e6, 9e8}) {
      const FieldResult result = field.evaluate({{x, 0, 0}, Quat::Identity()});
      EXPECT_TRUE(std::isfinite(result.energy_kj_per_mol())) << "sigma " << sigma << ", r " << x;
      EXPECT_TRUE(is_finite(result.force_on_b) && is_finite(result.torque_on_b)) << "sigma " << sigma << ", r " << x;
    }
  }
}

TEST_P(Kernel, RepeatsItselfToTheBit) {
  std::mt19937 random(kMoleculeSeed);
  const MoleculePair pair = random_pair(333, 77, 2.0, random);
  MolecularField one(pair.a, pair.b, {}, GetParam());
  MolecularField other(pair.a, pair.b, {}, GetParam());
  const FieldResult first = one.evaluate(pair.X_AB);
  other.evaluate({{50, 0, 0}, Quat::Identity()});
  const FieldResult second = other.evaluate(pair.X_AB);
  EXPECT_EQ(first.energy_kj_per_mol(), second.energy_kj_per_mol());
  EXPECT_EQ(first.force_on_b, second.force_on_b);
  EXPECT_EQ(first.torque_on_b, second.torque_on_b);
}

TEST(MolecularField, SelectsTheWidestKernelAndListsTheAvailableOnes) {
  const Molecule atom = test::one_atom(3.0, 1.0);
  const auto kernels = MolecularField::available_kernels();
  ASSERT_FALSE(kernels.empty());
  EXPECT_EQ(kernels.back(), "portable");
  EXPECT_EQ(MolecularField(atom, atom).kernel(), kernels.front());
  try {
    const MolecularField field(atom, atom, {}, "neon");
    FAIL() << "an unknown kernel was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("portable"), std::string::npos) << error.what();
  }
}

// The tests of class Kernel cover only the kernels that this processor supports. This test requires AVX2, and reports
// when the AVX-512 kernel remains untested.
TEST(MolecularField, HasTheVectorKernelsOfThisProcessor) {
  const auto kernels = MolecularField::available_kernels();
  if (std::ranges::count(kernels, "avx512") == 0) {
    test::note_left_out("MolecularField", "the kernel avx512, for which few processors have the instructions");
  }
  TANDEM_NEEDS_OF_MACHINE(std::ranges::count(kernels, "avx2") == 1, "a processor with AVX2 and FMA");
  EXPECT_EQ(kernels.size(), std::size_t{2} + (kernels.front() == "avx512" ? 1 : 0));
}

TEST(MolecularField, CountsTheMultiplyAddsOfItsPairs) {
  Molecule a = test::one_atom(3, 1), b = test::one_atom(0, 0);
  for (int i = 1; i < 5; ++i) {
    const Molecule other = test::one_atom(3, 1, {4.0 * i, 0, 0});
    a.positions_angstrom.push_back(other.positions_angstrom[0]);
    for (std::vector<double>* values : {&a.sigma_angstrom, &a.epsilon_kj_per_mol, &a.charge_e, &a.mass_u}) {
      values->push_back(values->front());
    }
  }
  b.charge_e = {1};
  FieldModel model;
  const std::string_view widest = MolecularField::available_kernels().front();
  const bool is_fused = widest != "portable";
  EXPECT_EQ(MolecularField(a, a, model).multiply_adds(), is_fused ? 25U * 22 : 25U * 13);
  a.mixes_arithmetically = true;
  EXPECT_EQ(MolecularField(a, a, model).multiply_adds(), is_fused ? 25U * 23 : 25U * 27 / 2);
  a.mixes_arithmetically = false;
  model.dielectric = Dielectric::kDistance;
  EXPECT_EQ(MolecularField(a, b, model).multiply_adds(), is_fused ? 5U * 16 : 5U * 10);
  EXPECT_EQ(MolecularField(a, a, model, "portable").multiply_adds(), 25U * 15);
  model.cutoff_angstrom = 8;
  MolecularField near(a, b, model);
  EXPECT_EQ(near.multiply_adds(), 0U);
  near.evaluate({{0, 3, 0}, Quat::Identity()});
  EXPECT_GT(near.multiply_adds(), near.pair_count() * (is_fused ? 64 : 41));
  near.evaluate({{90, 0, 0}, Quat::Identity()});
  EXPECT_EQ(near.multiply_adds(), 0U);
}

TEST(MolecularField, WorksWithoutAtoms) {
  const Molecule atom = test::one_atom(3.0, 1.0);
  EXPECT_EQ(MolecularField(Molecule(), atom).evaluate(Pose{}).energy_kj_per_mol(), 0.0);
  EXPECT_EQ(MolecularField(atom, Molecule()).evaluate(Pose{}).energy_kj_per_mol(), 0.0);
}

}  // namespace
}  // namespace tandem::docking
