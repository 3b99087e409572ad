#include "common/coupling.hpp"

#include <gtest/gtest.h>

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

TEST(CouplingState, TurnsTheShortWayRound) {
  const double angle = 2 * std::numbers::pi - 0.1;
  const Pose X_WH{Vec3::Zero(), quaternion_of({0, 0, angle})};
  EXPECT_NEAR(coupling_state(X_WH, {}, {}, {}).theta_W.z(), -0.1, 1e-9);
}

TEST(CouplingLaws, AreFoundByNameAndOnlyByAKnownOne) {
  ASSERT_NE(make_coupling_law("spring-damper", {}), nullptr);
  ASSERT_NE(make_coupling_law("", {}), nullptr);
  EXPECT_EQ(make_coupling_law("rubber-band", {}), nullptr);
}

}  // namespace
}  // namespace tandem
