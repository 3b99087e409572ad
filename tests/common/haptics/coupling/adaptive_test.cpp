#include "common/haptics/coupling/adaptive.hpp"

#include <gtest/gtest.h>

#include "common/haptics/coupling/laws.hpp"

namespace tandem::haptics {
namespace {

TEST(AdaptiveFit, ReproducesThePublishedLineOfTheThesis) {
  const AdaptiveFit fit = thesis_adaptive_fit();
  for (const double mass_kg : {0.05, 0.1, 0.15, 0.2}) {
    const CouplingParameters c = adapted(fit, mass_kg, 0, {});
    EXPECT_NEAR(c.stiffness_n_per_m, 116.53 * mass_kg + 16.21, 1e-12);
    EXPECT_EQ(c.damping_n_s_per_m, 0.2);
  }
  // The thesis's values are not usable: a mass of 0.2 kg would sag by m g / k = 50 mm.
  EXPECT_NEAR(0.2 * 9.81 / adapted(fit, 0.2, 0, {}).stiffness_n_per_m, 0.0497, 1e-4);
}

TEST(AdaptiveFit, UsesTheNearestEndOutsideOfItsMassRange) {
  const AdaptiveFit fit = thesis_adaptive_fit();
  EXPECT_EQ(adapted(fit, 0.001, 0, {}), adapted(fit, 0.05, 0, {}));
  EXPECT_EQ(adapted(fit, 7, 0, {}), adapted(fit, 0.2, 0, {}));
}

TEST(AdaptiveFit, LeavesRotationAndLimitsAloneWithoutARotationalRange) {
  const CouplingParameters base{.stiffness_n_m_per_rad = 0.7, .damping_n_m_s_per_rad = 0.02, .force_limit_n = 3};
  CouplingParameters expected = base;
  expected.stiffness_n_per_m = 116.53 * 0.1 + 16.21;
  expected.damping_n_s_per_m = 0.2;
  EXPECT_EQ(adapted(thesis_adaptive_fit(), 0.1, 4e-5, base), expected);
}

TEST(AdaptiveFit, DerivesRotationFromInertiaAndDampingFromStiffness) {
  AdaptiveFit fit = thesis_adaptive_fit();
  fit.damping_n_s_per_m.c = {0.1, 0.01, 0, 0};
  fit.inertia_low_kg_m2 = 1e-5;
  fit.inertia_high_kg_m2 = 1e-3;
  fit.stiffness_n_m_per_rad.c = {0.1, 200, 1e4, 1e5};
  fit.damping_n_m_s_per_rad.c = {0, 0.02, 0, 0};
  const CouplingParameters c = adapted(fit, 0.1, 1e-4, {});
  EXPECT_NEAR(c.damping_n_s_per_m, 0.1 + 0.01 * (116.53 * 0.1 + 16.21), 1e-12);
  EXPECT_NEAR(c.stiffness_n_m_per_rad, 0.1 + 200 * 1e-4 + 1e4 * 1e-8 + 1e5 * 1e-12, 1e-12);
  EXPECT_NEAR(c.damping_n_m_s_per_rad, 0.02 * c.stiffness_n_m_per_rad, 1e-12);
  EXPECT_EQ(adapted(fit, 0.1, 1, {}), adapted(fit, 0.1, 1e-3, {}));
  EXPECT_EQ(adapted(fit, 0.1, 0, {}), adapted(fit, 0.1, 1e-5, {}));
}

TEST(AdaptiveSpringDamper, HasTheForceOfTheThesis) {
  const auto law = make_coupling_law("adaptive", adapted(thesis_adaptive_fit(), 0.1, 0, {}));
  const Wrench wrench = law->wrench_on_tool_W({.d_W = {0.03, 0, 0}, .v_W = {0, 0.5, 0}});
  EXPECT_NEAR((wrench.f - Vec3((116.53 * 0.1 + 16.21) * 0.03, 0.2 * 0.5, 0)).norm(), 0, 1e-12);
}

TEST(AdaptiveSpringDamper, IsLimpNotRepellentWhereAFitDipsBelowZero) {
  AdaptiveFit fit = thesis_adaptive_fit();
  fit.stiffness_n_per_m.c = {-5, 0, 0, 0};
  const auto law = make_coupling_law("adaptive", adapted(fit, 0.1, 0, {}));
  EXPECT_EQ(law->wrench_on_tool_W({.d_W = {0.03, 0, 0}}).f, Vec3::Zero());
}

}  // namespace
}  // namespace tandem::haptics
