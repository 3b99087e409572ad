#include "common/haptics/coupling/saturation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "tests/common/haptics/coupling/coupling_draws.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

// Values of the device in the thesis (saturation.hpp): a limit of 6.5 N, with smooth saturation in the last fifth of
// the range.
constexpr double kLimit = 6.5;
constexpr double kSoftness = 0.2;
constexpr double kKnee = 5.2;

TEST(Saturation, LeavesAForceAloneUpToTheKnee) {
  for (int i = 0; i <= 5200; ++i) EXPECT_EQ(saturated(i * 1e-3, kLimit, kSoftness), i * 1e-3);
}

TEST(Saturation, FollowsTheClosedFormAboveTheKnee) {
  // At the distance softness × limit above the knee, the exponential term has fallen to 1/e.
  EXPECT_NEAR(saturated(kKnee + kSoftness * kLimit, kLimit, kSoftness), kLimit * (1 - kSoftness / std::numbers::e),
              1e-12);
  EXPECT_LT(saturated(kKnee + 0.01, kLimit, kSoftness), kKnee + 0.01);
}

TEST(Saturation, HasNoCornerAtTheKnee) {
  constexpr double kStep = 1e-6;
  const double at_knee = saturated(kKnee, kLimit, kSoftness);
  const double before = (at_knee - saturated(kKnee - kStep, kLimit, kSoftness)) / kStep;
  const double after = (saturated(kKnee + kStep, kLimit, kSoftness) - at_knee) / kStep;
  // The tolerances allow for the second derivative just above the knee, −1/(ε F_max) = −0.77/N.
  EXPECT_NEAR(before, 1, 1e-8);
  EXPECT_NEAR(after, 1, 1e-6);
  EXPECT_NEAR(saturation_slope(kKnee + kStep, kLimit, kSoftness), 1, 1e-6);
}

TEST(Saturation, SlopeIsThatOfTheMagnitude) {
  for (double force = 5.21; force < 20; force += 0.01) {
    constexpr double kStep = 1e-5;
    const double slope =
        (saturated(force + kStep, kLimit, kSoftness) - saturated(force - kStep, kLimit, kSoftness)) / (2 * kStep);
    ASSERT_NEAR(saturation_slope(force, kLimit, kSoftness), slope, 1e-9) << force;
  }
}

TEST(Saturation, RisesAndNeverPassesTheLimit) {
  double before = 0;
  for (double force = 0; force < 40; force += 0.01) {
    const double now = saturated(force, kLimit, kSoftness);
    ASSERT_GE(now, before);
    ASSERT_LE(now, kLimit);
    before = now;
  }
  for (const double force : {1e3, 1e150, std::numeric_limits<double>::max(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(saturated(force, kLimit, kSoftness), kLimit);
  }
}

TEST(Saturation, IsAClampWithoutSoftnessAndBendsFromTheStartWithAllOfIt) {
  EXPECT_EQ(saturated(6.4, kLimit, 0), 6.4);
  EXPECT_EQ(saturated(6.6, kLimit, 0), kLimit);
  EXPECT_NEAR(saturated(1, kLimit, 1), kLimit * (1 - std::exp(-1 / kLimit)), 1e-12);
}

TEST(Saturation, KeepsTheDirection) {
  const std::uint64_t seed = test::test_seed(41);
  Random random(seed);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 force = random_vector(random, random_magnitude(random, 0.1, 1e200));
    const Vec3 bent = saturated(force, kLimit, kSoftness);
    ASSERT_NEAR(bent.normalized().dot((force / force.cwiseAbs().maxCoeff()).normalized()), 1, 1e-12)
        << "seed " << seed << " draw " << i;
    ASSERT_LE(bent.norm(), kLimit * (1 + 1e-15)) << "seed " << seed << " draw " << i;
  }
}

TEST(Saturation, IsZeroForInputThatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Vec3& force : {Vec3(nan, 1, 1), Vec3(0, infinity, 0), Vec3(-infinity, infinity, nan)}) {
    EXPECT_EQ(saturated(force, kLimit, kSoftness), Vec3::Zero());
    EXPECT_EQ(saturation_gradient(force, kLimit, kSoftness), Eigen::Matrix3d::Zero());
  }
}

TEST(Saturation, GradientIsThatOfTheVectorBelowAndAboveTheKnee) {
  const std::uint64_t seed = test::test_seed(43);
  Random random(seed);
  int bent = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 force = random_vector(random, random_magnitude(random, 1, 100));
    if (std::abs(force.norm() - kKnee) < 1e-3) continue;
    constexpr double kStep = 1e-5;
    Eigen::Matrix3d slope;
    for (int k = 0; k < 3; ++k) {
      const Vec3 step = kStep * Vec3::Unit(k);
      slope.col(k) =
          (saturated(Vec3(force + step), kLimit, kSoftness) - saturated(Vec3(force - step), kLimit, kSoftness)) /
          (2 * kStep);
    }
    const Eigen::Matrix3d given = saturation_gradient(force, kLimit, kSoftness);
    ASSERT_LT((given - slope).norm(), 1e-8) << "seed " << seed << " draw " << i;
    const Vec3 eigenvalues = given.selfadjointView<Eigen::Lower>().eigenvalues();
    ASSERT_GE(eigenvalues.minCoeff(), -1e-15) << "seed " << seed << " draw " << i;
    ASSERT_LE(eigenvalues.maxCoeff(), 1 + 1e-15) << "seed " << seed << " draw " << i;
    bent += force.norm() > kKnee ? 1 : 0;
  }
  EXPECT_GT(bent, 300);
  EXPECT_LT(bent, 900);
}

}  // namespace
}  // namespace tandem::haptics
