#include "common/haptics/coupling/radial.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace tandem::haptics {
namespace {

TEST(Polar, HasLengthAndDirectionWhereSquaresOverflowOrVanish) {
  for (const double scale : {1e-200, 1.0, 1e200}) {
    const Polar p = polar(scale * Vec3(3, 0, -4));
    EXPECT_NEAR(p.length / scale, 5, 1e-14);
    EXPECT_LT((p.direction - Vec3(0.6, 0, -0.8)).norm(), 1e-15);
  }
}

TEST(Polar, IsEmptyForZeroOrNonFiniteInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Vec3& a : {Vec3(0, 0, 0), Vec3(nan, 1, 1), Vec3(1, -infinity, 0)}) {
    EXPECT_EQ(polar(a).length, 0);
    EXPECT_EQ(polar(a).direction, Vec3::Zero());
  }
}

TEST(Polar, LengthIsFiniteForTheLongestVector) {
  const double most = std::numeric_limits<double>::max();
  EXPECT_EQ(polar({most, most, most}).length, most);
}

TEST(RadialGradient, IsTheSlopeAlongAndTheSecantAcross) {
  const Vec3 along(0.6, 0, -0.8);
  const Vec3 across(0.8, 0, 0.6);
  const Eigen::Matrix3d gradient = radial_gradient(along, {.secant = 2, .slope = 7});
  EXPECT_LT((gradient * along - 7 * along).norm(), 1e-14);
  EXPECT_LT((gradient * across - 2 * across).norm(), 1e-14);
  EXPECT_LT((gradient * Vec3::UnitY() - 2 * Vec3::UnitY()).norm(), 1e-14);
}

}  // namespace
}  // namespace tandem::haptics
