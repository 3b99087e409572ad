#include "common/contact/solver/contact_rows.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "common/base/random.hpp"

namespace tandem::contact {
namespace {

Vec3 random_vector(Random& random, double scale) {
  return {random.uniform(-scale, scale), random.uniform(-scale, scale), random.uniform(-scale, scale)};
}

PatchTerms terms_of(double friction) {
  PatchTerms terms;
  terms.about_W = {0.01, -0.02, 0.03};
  terms.step_s = 1e-3;
  terms.stiffness_n_per_m3 = 5e9;
  terms.dissipation_s = 2e-3;
  terms.friction = friction;
  terms.rigid_depth_m = 5e-4;
  terms.hard_n_per_m = 1e6;
  return terms;
}

/// Random contacts of all kinds: with a gap, in the soft layer, and below the rigid depth.
std::vector<ContactPoint> random_contacts(Random& random, int count) {
  std::vector<ContactPoint> contacts(static_cast<std::size_t>(count));
  for (ContactPoint& contact : contacts) {
    contact.p_W = random_vector(random, 0.02);
    contact.normal_W = random_vector(random, 1).normalized();
    contact.depth_m = random.uniform(-5e-4, 7e-4);
    contact.area_m2 = random.uniform(1e-8, 1e-6);
    contact.bristle_W = random_vector(random, 1e-4);
  }
  return contacts;
}

Vec6 vector_of(const Wrench& wrench) {
  return (Vec6() << wrench.f, wrench.t).finished();
}

TEST(ContactRows, DerivativeIsThatOfTheWrenchStickingSlippingAndHard) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (const double friction : {0.0, 0.05, 0.5, 50.0}) {  // with 0 all contacts slip, with 50 all stick
    for (int draw = 0; draw < 50; ++draw) {
      const std::vector<ContactPoint> contacts = random_contacts(random, 1 + draw % 3);
      ContactRows rows(contacts.size(), 1);
      PatchTerms terms = terms_of(friction);
      std::uint32_t ill = 0;
      ASSERT_TRUE(rows.append(contacts, terms, ill));
      const Twist twist{random_vector(random, 0.1), random_vector(random, 1)};
      rows.evaluate(terms, twist, FrictionLimit::kFollows);
      rows.evaluate(terms, twist, FrictionLimit::kKept);
      const Mat6 derivative = rows.derivative(terms);
      for (int k = 0; k < 6; ++k) {
        // Step of the finite differences [m/s]. A difference is wrong if the force has a kink within the step. The step
        // is so small that this happens in one of several thousand draws.
        constexpr double kDifference = 1e-7;
        const auto wrench = [&](double by) {
          Twist moved = twist;
          (k < 3 ? moved.v : moved.w)[k % 3] += by;
          return vector_of(rows.evaluate(terms, moved, FrictionLimit::kKept));
        };
        const Vec6 slope = (wrench(kDifference) - wrench(-kDifference)) / (2 * kDifference);
        ASSERT_LT((slope + derivative.col(k)).norm(), 1e-5 * derivative.norm() + 1e-6)
            << "seed " << kSeed << " friction " << friction << " draw " << draw << " column " << k;
      }
    }
  }
}

TEST(ContactRows, OppositeContactsMakeAWrenchAboutTheGivenPoint) {
  ContactRows rows(1, 1);
  PatchTerms terms = terms_of(0);
  std::uint32_t ill = 0;
  const ContactPoint contact{{0.03, -0.02, 0.03}, Vec3::UnitZ(), 1e-4, 1e-6, Vec3::Zero(), 0};
  ASSERT_TRUE(rows.append({&contact, 1}, terms, ill));
  const Wrench wrench = rows.evaluate(terms, {}, FrictionLimit::kFollows);
  EXPECT_NEAR(wrench.f.z(), 5e9 * 1e-6 * 1e-4, 1e-12);
  EXPECT_NEAR((wrench.t - Vec3(0.02, 0, 0).cross(wrench.f)).norm(), 0, 1e-12);
}

TEST(ContactRows, ForcesNeverPullForAnyClosingSpeed) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  ContactRows rows(1, 1);
  for (int draw = 0; draw < 1000; ++draw) {
    const std::vector<ContactPoint> contacts = random_contacts(random, 1);
    rows.clear();
    PatchTerms terms = terms_of(0);
    std::uint32_t ill = 0;
    ASSERT_TRUE(rows.append(contacts, terms, ill));
    const Twist twist{random_vector(random, 1), random_vector(random, 10)};
    ASSERT_GE(rows.evaluate(terms, twist, FrictionLimit::kFollows).f.dot(contacts[0].normal_W), 0)
        << "seed " << kSeed << " draw " << draw;
  }
}

TEST(ContactRows, FrictionNeverExceedsTheCone) {
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  ContactRows rows(1, 1);
  for (int draw = 0; draw < 1000; ++draw) {
    std::vector<ContactPoint> contacts = random_contacts(random, 1);
    rows.clear();
    PatchTerms terms = terms_of(0.4);
    std::uint32_t ill = 0;
    ASSERT_TRUE(rows.append(contacts, terms, ill));
    const Vec3 n = contacts[0].normal_W;
    const Vec3 force = rows.evaluate(terms, {random_vector(random, 1)}, FrictionLimit::kFollows).f;
    const double normal = force.dot(n);
    ASSERT_LE((force - normal * n).norm(), 0.4 * normal * (1 + 1e-9) + 1e-9) << "seed " << kSeed << " draw " << draw;
    rows.finish(terms, contacts);
    ASSERT_LE(0.8 * 5e9 * contacts[0].area_m2 * contacts[0].bristle_W.norm(), 0.4 * normal * (1 + 1e-9) + 1e-9);
    ASSERT_NEAR(contacts[0].bristle_W.dot(n), 0, 1e-12);
  }
}

TEST(ContactRows, AContactThatIsNotFiniteIsCountedAndHasNoForce) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<ContactPoint> contacts(6, {Vec3::Zero(), Vec3::UnitZ(), 1e-4, 1e-6, Vec3::Zero(), 0});
  contacts[0].p_W.x() = nan;
  contacts[1].normal_W = Vec3(0, 0, 7);
  contacts[2].depth_m = std::numeric_limits<double>::infinity();
  contacts[3].area_m2 = -1;
  contacts[4].bristle_W.y() = nan;
  ContactRows rows(contacts.size(), 1);
  PatchTerms terms = terms_of(0.5);
  std::uint32_t ill = 0;
  ASSERT_TRUE(rows.append(contacts, terms, ill));
  EXPECT_EQ(ill, 5U);
  EXPECT_NEAR(rows.evaluate(terms, {}, FrictionLimit::kFollows).f.z(), 5e9 * 1e-6 * 1e-4, 1e-12);
  EXPECT_TRUE(rows.derivative(terms).allFinite());
}

TEST(BlockCholesky, GivesTheSolutionOfADenseSolver) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  constexpr std::size_t kBlocks = 5;
  BlockCholesky system(kBlocks);
  for (int draw = 0; draw < 20; ++draw) {
    // The blocks (3, 1), (4, 0) and (4, 2) of the matrix are filled; all other blocks off the diagonal are zero.
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * kBlocks, 6 * kBlocks);
    const auto add = [&](int row, int column) {
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
          const double x = random.uniform(-1, 1);
          dense(6 * row + i, 6 * column + j) += x;
          dense(6 * column + j, 6 * row + i) += x;
        }
      }
    };
    for (int i = 0; i < int(kBlocks); ++i) add(i, i);
    add(3, 1);
    add(4, 0);
    add(4, 2);
    dense.diagonal().array() += 20;  // makes the matrix positive definite, by Gershgorin's theorem
    system.reset(kBlocks);
    for (const auto& [row, column] : {std::pair{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}, {3, 1}, {4, 0}, {4, 2}}) {
      system.block(std::size_t(row), std::size_t(column)) = dense.block<6, 6>(6 * row, 6 * column);
    }
    Eigen::VectorXd right(6 * kBlocks);
    for (double& x : right) x = random.uniform(-1, 1);
    std::vector<Vec6> x(kBlocks);
    for (std::size_t i = 0; i < kBlocks; ++i) x[i] = right.segment<6>(static_cast<Eigen::Index>(6 * i));
    ASSERT_TRUE(system.factor());
    system.solve(x);
    const Eigen::VectorXd expected = dense.llt().solve(right);
    for (std::size_t i = 0; i < kBlocks; ++i) {
      ASSERT_LT((x[i] - expected.segment<6>(static_cast<Eigen::Index>(6 * i))).norm(), 1e-13) << "seed " << kSeed;
    }
  }
}

TEST(BlockCholesky, RefusesAMatrixThatIsNotPositiveDefinite) {
  BlockCholesky system(2);
  system.reset(2);
  system.block(0, 0).setIdentity();
  system.block(1, 0).setIdentity();
  system.block(1, 1) = 0.5 * Mat6::Identity();
  EXPECT_FALSE(system.factor());
  system.reset(1);
  system.block(0, 0).setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(system.factor());
}

}  // namespace
}  // namespace tandem::contact
