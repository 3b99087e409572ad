// Tests requirements that every coupling law must meet, whatever its curve.
#include "common/haptics/coupling/laws.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/common/haptics/coupling/coupling_draws.hpp"
#include "tests/common/haptics/coupling/law_instances.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

class EveryCouplingLaw : public testing::TestWithParam<CouplingLawInfo> {
 protected:
  static std::unique_ptr<CouplingLaw> make(const CouplingParameters& parameters) { return GetParam().make(parameters); }
  static bool pulls() { return GetParam().tool != ToolDynamics::kAtHandle; }
};

TEST_P(EveryCouplingLaw, IsMadeUnderItsNameForItsKindOfTool) {
  const auto law = make_coupling_law(GetParam().name, {});
  ASSERT_NE(law, nullptr);
  EXPECT_EQ(law->name(), GetParam().name);
  EXPECT_EQ(law->tool_dynamics(), GetParam().tool);
}

TEST_P(EveryCouplingLaw, IsZeroWhereHandleAndToolCoincide) {
  const std::uint64_t seed = test::test_seed(51);
  Random random(seed);
  for (int i = 0; i < 100; ++i) {
    const auto law = make(random_parameters(random));
    // Handle and tool have the same motion, so their relative velocity is zero. A law that damps the absolute motion
    // would fail.
    const CouplingState state{.v_WH = random_vector(random, 1), .w_WH = random_vector(random, 10)};
    ASSERT_EQ(law->wrench_on_tool_W(state).f, Vec3::Zero()) << "seed " << seed << " draw " << i;
    ASSERT_EQ(law->wrench_on_tool_W(state).t, Vec3::Zero()) << "seed " << seed << " draw " << i;
  }
}

TEST_P(EveryCouplingLaw, PullsHarderTheFartherTheHandle) {
  const std::uint64_t seed = test::test_seed(53);
  Random random(seed);
  for (int i = 0; i < 100; ++i) {
    const CouplingParameters c = random_parameters(random);
    const auto law = make(c);
    const Vec3 direction = random_vector(random, 1).normalized();
    const double way = i % 2 == 0 ? 1 : -1;  // 1: the handle moves away from the tool; −1: it moves back
    Wrench before, now;
    for (double u = 0.01; u < 20; u *= 1.1) {
      now = law->wrench_on_tool_W({.d_W = u * c.force_limit_n / c.stiffness_n_per_m * direction,
                                   .theta_W = u * c.torque_limit_n_m / c.stiffness_n_m_per_rad * direction,
                                   .v_WH = way * direction,
                                   .w_WH = way * direction});
      ASSERT_GE(now.f.dot(direction), before.f.dot(direction) * (1 - 1e-14)) << "seed " << seed << " draw " << i;
      ASSERT_GE(now.t.dot(direction), before.t.dot(direction) * (1 - 1e-14)) << "seed " << seed << " draw " << i;
      before = now;
    }
    if (!pulls()) continue;
    // Saturation reduces the force of a curve that reaches the limit, because it bends below the limit. With the
    // softness ε and Euler's number e, the force is smaller by the fraction ε/e of the limit, at most 37 %.
    ASSERT_GT(now.f.dot(direction), 0.63 * c.force_limit_n) << "seed " << seed << " draw " << i;
    ASSERT_GT(now.t.dot(direction), 0.63 * c.torque_limit_n_m) << "seed " << seed << " draw " << i;
  }
}

TEST_P(EveryCouplingLaw, StaysFiniteAndWithinItsLimitsForAnyInput) {
  const std::uint64_t seed = test::test_seed(57);
  Random random(seed);
  for (int i = 0; i < 20'000; ++i) {
    const CouplingParameters c = random_parameters(random);
    const auto law = make(c);
    const CouplingState state = hostile_state(random);
    const Wrench wrench = law->wrench_on_tool_W(state);
    ASSERT_TRUE(is_finite(wrench)) << "seed " << seed << " draw " << i;
    // Because of rounding, the length of the unit direction may exceed 1 by its last bit.
    ASSERT_LE(wrench.f.norm(), c.force_limit_n * (1 + 1e-15)) << "seed " << seed << " draw " << i;
    ASSERT_LE(wrench.t.norm(), c.torque_limit_n_m * (1 + 1e-15)) << "seed " << seed << " draw " << i;
    const CouplingGradient gradient = law->gradient(state);
    ASSERT_TRUE(gradient.force_by_d.allFinite() && gradient.force_by_v.allFinite() &&
                gradient.torque_by_theta.allFinite() && gradient.torque_by_w.allFinite())
        << "seed " << seed << " draw " << i;
  }
}

TEST_P(EveryCouplingLaw, StaysFiniteForAnyParameters) {
  const std::uint64_t seed = test::test_seed(59);
  Random random(seed);
  for (int i = 0; i < 20'000; ++i) {
    const CouplingParameters c{hostile_number(random), hostile_number(random), hostile_number(random),
                               hostile_number(random), hostile_number(random), hostile_number(random),
                               hostile_number(random), hostile_number(random)};
    const auto law = make(c);
    const CouplingState plain{random_vector(random, 1), random_vector(random, 1), random_vector(random, 1),
                              random_vector(random, 1), random_vector(random, 1), random_vector(random, 1)};
    ASSERT_TRUE(is_finite(law->wrench_on_tool_W(plain))) << "seed " << seed << " draw " << i;
    ASSERT_TRUE(is_finite(law->wrench_on_tool_W(hostile_state(random)))) << "seed " << seed << " draw " << i;
  }
}

TEST_P(EveryCouplingLaw, AcceptsParametersWhileItRuns) {
  const std::uint64_t seed = test::test_seed(61);
  Random random(seed);
  const auto law = make({});
  for (int i = 0; i < 100; ++i) {
    const CouplingParameters c = random_parameters(random);
    const CouplingState state{.d_W = random_vector(random, 0.01), .theta_W = random_vector(random, 0.1)};
    law->set_parameters(c);
    ASSERT_EQ(law->wrench_on_tool_W(state).f, make(c)->wrench_on_tool_W(state).f) << "seed " << seed;
    ASSERT_EQ(law->wrench_on_tool_W(state).t, make(c)->wrench_on_tool_W(state).t) << "seed " << seed;
  }
}

TEST_P(EveryCouplingLaw, SumsToZeroOverBothEndsAboutAnyPoint) {
  const std::uint64_t seed = test::test_seed(23);
  Random random(seed);
  for (int i = 0; i < 1000; ++i) {
    const auto law = make(random_parameters(random));
    const auto pose = [&random] { return Pose{random_vector(random, 0.1), quaternion_of(random_vector(random, 0.8))}; };
    const auto twist = [&random] { return Twist{random_vector(random, 0.5), random_vector(random, 5)}; };
    const Pose X_WH = pose(), X_WT = pose();
    const auto [on_tool, on_hand] = coupling_wrenches(*law, X_WH, twist(), X_WT, twist());
    const Vec3 point = random_vector(random, 1);
    const Vec3 moment = on_tool.t + (X_WT.p - point).cross(on_tool.f) + on_hand.t + (X_WH.p - point).cross(on_hand.f);
    ASSERT_EQ(on_tool.f + on_hand.f, Vec3::Zero()) << "seed " << seed << " draw " << i;
    // Lever arms are some metres and forces at most 40 N. The bound is the rounding error of 100 N·m.
    ASSERT_LT(moment.norm(), 1e-13) << "seed " << seed << " draw " << i;
  }
}

TEST_P(EveryCouplingLaw, TurnsTheShortWayRound) {
  const auto law = make({});
  constexpr double kAngle = 0.3;
  const Pose tool;
  const auto torque_at = [&](double angle) {
    const Pose handle{Vec3::Zero(), quaternion_of({0, 0, angle})};
    return law->wrench_on_tool_W(coupling_state(handle, {}, tool, {})).t;
  };
  const Vec3 long_way = torque_at(2 * std::numbers::pi - kAngle);
  EXPECT_LT((long_way - torque_at(-kAngle)).norm(), 1e-14);
  EXPECT_EQ(long_way.z() < 0, pulls());
}

TEST_P(EveryCouplingLaw, AllocatesNothing) {
  const std::uint64_t seed = test::test_seed(67);
  Random random(seed);
  const auto law = make({});
  double sum = 0;
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 100; ++i) {
    law->set_parameters(random_parameters(random));
    const CouplingState state{random_vector(random, 0.1), random_vector(random, 1), random_vector(random, 1),
                              random_vector(random, 1),   random_vector(random, 1), random_vector(random, 1)};
    sum += law->wrench_on_tool_W(state).f.norm() + law->gradient(state).force_by_d.norm();
  }
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_EQ(sum > 0, pulls());
}

INSTANTIATE_TEST_SUITE_P(Catalog, EveryCouplingLaw, testing::ValuesIn(coupling_laws()), law_test_name);

TEST(CouplingLaws, AreFoundOnlyByTheirNames) {
  EXPECT_EQ(make_coupling_law("", {})->name(), "stable-dynamic");
  EXPECT_EQ(coupling_laws().front().name, kDefaultCouplingLaw);
  EXPECT_EQ(make_coupling_law("rubber-band", {}), nullptr);
  EXPECT_EQ(find_coupling_law("Spring-Damper"), nullptr);
}

TEST(CouplingLaws, AreListedForMessagesInTheCatalogsOrder) {
  EXPECT_EQ(listed_coupling_law_names(),
            "stable-dynamic, spring-damper, adaptive, qsa-static, qsa-dynamic, stable-dynamic-literal, direct");
}

// Parameters of the example in the thesis, to test the published curves: 4 N, 20 mm, 200 N/m.
constexpr CouplingParameters kLawsExample{.stiffness_n_per_m = 200, .damping_n_s_per_m = 0, .force_limit_n = 4};

double force_at(std::string_view law, double d_m, double handle_m_per_s) {
  return make_coupling_law(law, kLawsExample)
      ->wrench_on_tool_W({.d_W = {d_m, 0, 0}, .v_WH = {handle_m_per_s, 0, 0}})
      .f.x();
}

TEST(CouplingLaws, FollowTheirPublishedCurves) {
  EXPECT_NEAR(force_at("stable-dynamic", 0.010, 1), 4 * (1 - std::exp(-0.25)), 1e-12);
  EXPECT_NEAR(force_at("stable-dynamic", 0.010, -1), 4 * (1 - std::exp(-0.25)), 1e-12);
  EXPECT_NEAR(force_at("stable-dynamic-literal", 0.010, 1), 4 * (1 - std::exp(-0.25)), 1e-12);
  EXPECT_NEAR(force_at("stable-dynamic-literal", 0.010, -1), 2, 1e-12);
  for (const std::string_view qsa : {"qsa-static", "qsa-dynamic"}) {
    EXPECT_NEAR(force_at(qsa, 0.010, 1), 4 * (1 - std::exp(-0.5)), 1e-12) << qsa;
    EXPECT_NEAR(force_at(qsa, 0.010, -1), 2, 1e-12) << qsa;
  }
}

TEST(StableDynamic, ShowsItsLimitLessTheShareOfTheSoftness) {
  // The curve reaches 4 N, but the saturation bends all forces above 3.2 N.
  EXPECT_NEAR(force_at("stable-dynamic", 0.5, 1), 4 * (1 - 0.2 / std::numbers::e), 1e-12);
}

TEST(SteepestSlope, IsTheLargestGradientOfEveryLaw) {
  for (const double sharpness : {0.1, 0.5, 1.0, 3.0, 10.0}) {
    CouplingParameters parameters;
    parameters.curve_sharpness = sharpness;
    for (const CouplingLawInfo& info : coupling_laws()) {
      if (info.name == "direct") continue;
      const auto law = info.make(parameters);
      double steepest = 0;
      for (int i = 0; i < 4000; ++i) {
        CouplingState state;
        state.d_W.x() = i * 5e-5;  // up to 0.2 m
        for (const double speed : {-1e-12, 1e-12}) {
          state.v_WH.x() = speed;
          const double slope = law->gradient(state).force_by_d(0, 0);
          steepest = std::max(steepest, slope);
        }
      }
      // The displacements are sampled so densely that the largest slope found is accurate to 1e-4.
      EXPECT_NEAR(steepest, steepest_slope_factor(info.name, parameters) * parameters.stiffness_n_per_m,
                  1e-3 * parameters.stiffness_n_per_m)
          << info.name << ", c = " << sharpness;
    }
  }
}

}  // namespace
}  // namespace tandem::haptics
