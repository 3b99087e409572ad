#include "common/haptics/prediction/uniform_spline.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tandem::haptics {
namespace {

TEST(UniformCubic, ReproducesALine) {
  for (const double u : {0.0, 0.2, 0.5, 1.0}) {
    const CurvePoint point = uniform_cubic({3 - 2, 3, 3 + 2, 3 + 4}, u);
    EXPECT_NEAR(point.value, 3 + 2 * u, 1e-14);
    EXPECT_NEAR(point.slope, 2, 1e-14);
    EXPECT_NEAR(point.curvature, 0, 1e-14);
  }
}

TEST(UniformCubic, NeighboursJoinWithTwoDerivatives) {
  const CurvePoint end = uniform_cubic({1, -2, 4, 0.5}, 1);
  const CurvePoint begin = uniform_cubic({-2, 4, 0.5, 9}, 0);
  EXPECT_NEAR(end.value, begin.value, 1e-14);
  EXPECT_NEAR(end.slope, begin.slope, 1e-14);
  EXPECT_NEAR(end.curvature, begin.curvature, 1e-14);
}

TEST(UniformCubic, DerivativesAreThoseOfTheValue) {
  const std::array<double, 4> control{1, -2, 4, 0.5};
  constexpr double kSpacing = 1e-5;
  for (const double u : {0.1, 0.45, 0.9}) {
    const CurvePoint low = uniform_cubic(control, u - kSpacing), high = uniform_cubic(control, u + kSpacing);
    EXPECT_NEAR(uniform_cubic(control, u).slope, (high.value - low.value) / (2 * kSpacing), 1e-8);
    EXPECT_NEAR(uniform_cubic(control, u).curvature, (high.slope - low.slope) / (2 * kSpacing), 1e-8);
  }
}

TEST(Faded, FallsFromOneToZero) {
  const CurvePoint difference{2, -3, 5};
  const CurvePoint begin = faded(difference, 1e-12);
  EXPECT_NEAR(begin.value, 2, 1e-9);
  EXPECT_NEAR(begin.slope, -3, 1e-9);
  EXPECT_NEAR(begin.curvature, 5, 1e-9);
  const CurvePoint end = faded(difference, 1 - 1e-12);
  EXPECT_NEAR(end.value, 0, 1e-9);
  EXPECT_NEAR(end.slope, 0, 1e-9);
  EXPECT_NEAR(end.curvature, 0, 1e-9);
  EXPECT_EQ(faded(difference, 1.5).value, 0);
  constexpr double kSpacing = 1e-5;
  const CurvePoint low = faded(difference, 0.3 - kSpacing), high = faded(difference, 0.3 + kSpacing);
  EXPECT_NEAR(faded(difference, 0.3).slope, (high.value - low.value) / (2 * kSpacing), 1e-8);
  EXPECT_NEAR(faded(difference, 0.3).curvature, (high.slope - low.slope) / (2 * kSpacing), 1e-8);
}

}  // namespace
}  // namespace tandem::haptics
