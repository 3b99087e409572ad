#include "common/haptics/coupling/laws.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "tests/common/haptics/coupling/coupling_draws.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

TEST(SpringDamper, GivesHookesLawBelowItsLimit) {
  const auto law =
      make_coupling_law("spring-damper", {.stiffness_n_per_m = 200, .damping_n_s_per_m = 4, .force_limit_n = 100});
  const Wrench wrench = law->wrench_on_tool_W({.d_W = {0.01, 0, -0.02}, .v_W = {0, 0.1, 0}});
  EXPECT_NEAR((wrench.f - Vec3(2.0, 0.4, -4.0)).norm(), 0, 1e-12);
  EXPECT_EQ(wrench.t.norm(), 0);
}

TEST(SpringDamper, ShowsNoForceForAnInputThatIsNotFinite) {
  const auto law = make_coupling_law("spring-damper", {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const CouplingState state{.d_W = {nan, 1, 1}};
  EXPECT_EQ(law->wrench_on_tool_W(state).f.norm(), 0);
  EXPECT_EQ(law->gradient(state).force_by_d.norm(), 0);
  EXPECT_EQ(law->gradient(state).force_by_v.norm(), 0);
}

TEST(SpringDamper, KeepsTheDirectionFarBeyondItsLimit) {
  const auto law = make_coupling_law("spring-damper", {.stiffness_n_per_m = 1000, .force_limit_n = 5});
  const Vec3 d(0.3, -0.4, 1.2);
  const Wrench wrench = law->wrench_on_tool_W({.d_W = d});
  EXPECT_NEAR(wrench.f.norm(), 5, 1e-12);
  EXPECT_NEAR(wrench.f.normalized().dot(d.normalized()), 1, 1e-12);
}

TEST(CouplingState, TurnsTheShortWayRound) {
  const double angle = 2 * std::numbers::pi - 0.1;
  const Pose X_WH{Vec3::Zero(), quaternion_of({0, 0, angle})};
  EXPECT_NEAR(coupling_state(X_WH, {}, {}, {}).theta_W.z(), -0.1, 1e-9);
}

struct Ends {
  Pose X_WH, X_WT;
  Twist V_WH, V_WT;
};

Ends random_ends(Random& random) {
  const auto pose = [&random] { return Pose{random_vector(random, 0.1), quaternion_of(random_vector(random, 0.8))}; };
  const auto twist = [&random] { return Twist{random_vector(random, 0.5), random_vector(random, 5)}; };
  return {pose(), pose(), twist(), twist()};
}

TEST(CouplingWrenches, GiveOutNoMoreThanTheSpringLosesAndTheDamperTakesTheRest) {
  const std::uint64_t seed = test::test_seed(29);
  Random random(seed);
  CouplingParameters c;
  c.force_limit_n = c.torque_limit_n_m = 1e6;
  const auto law = make_coupling_law("spring-damper", c);
  const auto spring_energy_j = [&c](const Ends& ends, double after_s) {
    const CouplingState state =
        coupling_state(integrate(ends.X_WH, ends.V_WH, after_s), {}, integrate(ends.X_WT, ends.V_WT, after_s), {});
    return 0.5 * c.stiffness_n_per_m * state.d_W.squaredNorm() +
           0.5 * c.stiffness_n_m_per_rad * state.theta_W.squaredNorm();
  };
  for (int i = 0; i < 1000; ++i) {
    const Ends ends = random_ends(random);
    const auto [on_tool, on_hand] = coupling_wrenches(*law, ends.X_WH, ends.V_WH, ends.X_WT, ends.V_WT);
    const double power_w = on_tool.f.dot(ends.V_WT.v) + on_tool.t.dot(ends.V_WT.w) + on_hand.f.dot(ends.V_WH.v) +
                           on_hand.t.dot(ends.V_WH.w);
    // The error of the central difference is h²/6 times the third derivative. Here it is below 1e-7 of about 100 W.
    constexpr double kStep_s = 1e-5;
    const double spring_w = (spring_energy_j(ends, kStep_s) - spring_energy_j(ends, -kStep_s)) / (2 * kStep_s);
    const CouplingState state = coupling_state(ends.X_WH, ends.V_WH, ends.X_WT, ends.V_WT);
    const double damper_w =
        c.damping_n_s_per_m * state.v_W.squaredNorm() + c.damping_n_m_s_per_rad * state.w_W.squaredNorm();
    ASSERT_NEAR(power_w, -spring_w - damper_w, 1e-5) << "seed " << seed << " draw " << i;
    ASSERT_LE(power_w + spring_w, 1e-5) << "seed " << seed << " draw " << i;
  }
}

}  // namespace
}  // namespace tandem::haptics
