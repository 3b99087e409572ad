#include "common/coupling.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>
#include <numbers>

#include "common/random.hpp"

namespace tandem {
namespace {

Vec3 random_vector(Random& random, double scale) {
  return {random.uniform(-scale, scale), random.uniform(-scale, scale), random.uniform(-scale, scale)};
}

TEST(SpringDamper, GivesHookesLawBelowItsLimit) {
  const SpringDamper law({.stiffness_n_per_m = 200, .damping_n_s_per_m = 4, .force_limit_n = 100});
  const Wrench wrench = law.wrench_on_tool_W({.d_W = {0.01, 0, -0.02}, .v_W = {0, 0.1, 0}});
  EXPECT_NEAR((wrench.f - Vec3(2.0, 0.4, -4.0)).norm(), 0, 1e-12);
  EXPECT_EQ(wrench.t.norm(), 0);
}

TEST(SpringDamper, IsZeroWhereHandleAndToolCoincide) {
  const SpringDamper law({});
  const Wrench wrench = law.wrench_on_tool_W(coupling_state({}, {}, {}, {}));
  EXPECT_EQ(wrench.f.norm(), 0);
  EXPECT_EQ(wrench.t.norm(), 0);
}

TEST(SpringDamper, StaysWithinItsLimitsForAnyInput) {
  CouplingParameters parameters;
  const SpringDamper law(parameters);
  Random random(11);
  for (int i = 0; i < 10'000; ++i) {
    const double scale = std::pow(10.0, random.uniform(-6, 300));
    const Wrench wrench = law.wrench_on_tool_W({random_vector(random, scale), random_vector(random, 4.0),
                                                random_vector(random, scale), random_vector(random, scale)});
    ASSERT_TRUE(is_finite(wrench)) << "scale " << scale;
    ASSERT_LE(wrench.f.norm(), parameters.force_limit_n * (1 + 1e-12));
    ASSERT_LE(wrench.t.norm(), parameters.torque_limit_n_m * (1 + 1e-12));
  }
}

TEST(SpringDamper, ShowsNoForceForAnInputThatIsNotFinite) {
  const SpringDamper law({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(law.wrench_on_tool_W({.d_W = {nan, 1, 1}}).f.norm(), 0);
}

TEST(SpringDamper, KeepsTheDirectionWhenItClamps) {
  const SpringDamper law({.stiffness_n_per_m = 1000, .force_limit_n = 5});
  const Vec3 d(0.3, -0.4, 1.2);
  const Wrench wrench = law.wrench_on_tool_W({.d_W = d});
  EXPECT_NEAR(wrench.f.norm(), 5, 1e-12);
  EXPECT_NEAR(wrench.f.normalized().dot(d.normalized()), 1, 1e-12);
}

TEST(SpringDamper, GradientIsThatOfTheWrenchBelowAndBeyondTheLimits) {
  constexpr std::uint64_t kSeed = 13;
  Random random(kSeed);
  CouplingParameters c;
  const SpringDamper law(c);
  const auto slope_of = [&law](const CouplingState& state, Vec3 CouplingState::*by, Vec3 Wrench::*of) {
    Eigen::Matrix3d slope;
    for (int k = 0; k < 3; ++k) {
      CouplingState more = state, less = state;
      const double difference = 1e-6 * (1e-3 + (state.*by).norm());
      (more.*by)[k] += difference;
      (less.*by)[k] -= difference;
      slope.col(k) =
          (law.wrench_on_tool_W(more).*of - law.wrench_on_tool_W(less).*of) / ((more.*by)[k] - (less.*by)[k]);
    }
    return slope;
  };
  int limited = 0;
  for (int i = 0; i < 1000; ++i) {
    const double scale = std::pow(10.0, random.uniform(-2, 1));
    const CouplingState state{random_vector(random, scale * 0.02), random_vector(random, scale),
                              random_vector(random, scale), random_vector(random, 10 * scale)};
    const CouplingGradient gradient = law.gradient(state);
    const auto expect = [&](const Eigen::Matrix3d& given, Vec3 CouplingState::*by, Vec3 Wrench::*of, double most) {
      ASSERT_LT((given - slope_of(state, by, of)).norm(), 1e-5 * most) << "seed " << kSeed << " draw " << i;
      ASSERT_LT((given - given.transpose()).norm(), 1e-12 * most);
      ASSERT_GT(given.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-12 * most);
    };
    expect(gradient.force_by_d, &CouplingState::d_W, &Wrench::f, c.stiffness_n_per_m);
    expect(gradient.force_by_v, &CouplingState::v_W, &Wrench::f, c.damping_n_s_per_m);
    expect(gradient.torque_by_theta, &CouplingState::theta_W, &Wrench::t, c.stiffness_n_m_per_rad);
    expect(gradient.torque_by_w, &CouplingState::w_W, &Wrench::t, c.damping_n_m_s_per_rad);
    if (law.wrench_on_tool_W(state).f.norm() > c.force_limit_n * (1 - 1e-9)) ++limited;
  }
  EXPECT_GT(limited, 100);
  EXPECT_LT(limited, 900);
}

TEST(SpringDamper, GradientOfWhatIsNotFiniteIsZero) {
  const SpringDamper law({});
  const CouplingGradient gradient = law.gradient({.d_W = {std::numeric_limits<double>::quiet_NaN(), 0, 0}});
  EXPECT_EQ(gradient.force_by_d.norm(), 0);
  EXPECT_EQ(gradient.force_by_v.norm(), 0);
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

TEST(CouplingWrenches, BothEndsSumToZeroAboutAnyPoint) {
  constexpr std::uint64_t kSeed = 23;
  Random random(kSeed);
  const SpringDamper law(CouplingParameters{});
  for (int i = 0; i < 1000; ++i) {
    const Ends ends = random_ends(random);
    const auto [on_tool, on_hand] = coupling_wrenches(law, ends.X_WH, ends.V_WH, ends.X_WT, ends.V_WT);
    const Vec3 point = random_vector(random, 1);
    const Vec3 moment =
        on_tool.t + (ends.X_WT.p - point).cross(on_tool.f) + on_hand.t + (ends.X_WH.p - point).cross(on_hand.f);
    ASSERT_EQ((on_tool.f + on_hand.f).norm(), 0) << "seed " << kSeed << " draw " << i;
    ASSERT_LT(moment.norm(), 1e-13) << "seed " << kSeed << " draw " << i;
  }
}

TEST(CouplingWrenches, GiveOutNoMoreThanTheSpringLosesAndTheDamperTakesTheRest) {
  constexpr std::uint64_t kSeed = 29;
  Random random(kSeed);
  CouplingParameters c;
  c.force_limit_n = c.torque_limit_n_m = 1e6;
  const SpringDamper law(c);
  const auto spring_energy_j = [&c](const Ends& ends, double after_s) {
    const CouplingState state =
        coupling_state(integrate(ends.X_WH, ends.V_WH, after_s), {}, integrate(ends.X_WT, ends.V_WT, after_s), {});
    return 0.5 * c.stiffness_n_per_m * state.d_W.squaredNorm() +
           0.5 * c.stiffness_n_m_per_rad * state.theta_W.squaredNorm();
  };
  for (int i = 0; i < 1000; ++i) {
    const Ends ends = random_ends(random);
    const auto [on_tool, on_hand] = coupling_wrenches(law, ends.X_WH, ends.V_WH, ends.X_WT, ends.V_WT);
    const double power_w = on_tool.f.dot(ends.V_WT.v) + on_tool.t.dot(ends.V_WT.w) + on_hand.f.dot(ends.V_WH.v) +
                           on_hand.t.dot(ends.V_WH.w);
    // Central difference: its error is h²/6 of the third derivative, here below 1e-7 of some 100 W.
    constexpr double kStep_s = 1e-5;
    const double spring_w = (spring_energy_j(ends, kStep_s) - spring_energy_j(ends, -kStep_s)) / (2 * kStep_s);
    const CouplingState state = coupling_state(ends.X_WH, ends.V_WH, ends.X_WT, ends.V_WT);
    const double damper_w =
        c.damping_n_s_per_m * state.v_W.squaredNorm() + c.damping_n_m_s_per_rad * state.w_W.squaredNorm();
    ASSERT_NEAR(power_w, -spring_w - damper_w, 1e-5) << "seed " << kSeed << " draw " << i;
    ASSERT_LE(power_w + spring_w, 1e-5) << "seed " << kSeed << " draw " << i;
  }
}

TEST(CouplingLaws, AreFoundByNameAndOnlyByAKnownOne) {
  ASSERT_NE(make_coupling_law("spring-damper", {}), nullptr);
  ASSERT_NE(make_coupling_law("", {}), nullptr);
  EXPECT_EQ(make_coupling_law("rubber-band", {}), nullptr);
}

}  // namespace
}  // namespace tandem
