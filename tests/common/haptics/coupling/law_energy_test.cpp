// Tests the energy balance of passive and active laws in the limit of small steps. The test of forces that are sampled
// and held is coupling_passivity_controller_test.cpp.
#include <gtest/gtest.h>

#include "tests/common/haptics/coupling/coupling_draws.hpp"
#include "tests/common/haptics/coupling/law_instances.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

constexpr std::uint64_t kUsualSeed = 83;
constexpr int kSteps = 4000;

/// Work along a path: the net work, and the sum of the magnitudes of all its parts.
struct Work {
  double net_j = 0;
  double gross_j = 0;
  void add(double joules) {
    net_j += joules;
    gross_j += std::abs(joules);
  }
};

CouplingParameters undamped(CouplingParameters c) {
  c.damping_n_s_per_m = c.damping_n_m_s_per_rad = 0;
  return c;
}

/// Returns the work on the tool while `handle` moves along a closed path around it.
Work work_of_force(const CouplingLaw& law, const Loop& handle) {
  Work work;
  for (int k = 0; k < kSteps; ++k) {
    const Vec3 step = handle((k + 1.0) / kSteps) - handle(static_cast<double>(k) / kSteps);
    const Wrench wrench = law.wrench_on_tool_W({.d_W = handle((k + 0.5) / kSteps), .v_WH = kSteps * step});
    work.add(wrench.f.dot(step));
  }
  return work;
}

Work work_of_torque(const CouplingLaw& law, const Loop& orientation) {
  Work work;
  for (int k = 0; k < kSteps; ++k) {
    const Quat before = quaternion_of(orientation(static_cast<double>(k) / kSteps));
    const Vec3 step = rotation_vector(quaternion_of(orientation((k + 1.0) / kSteps)) * before.conjugate());
    const Pose halfway{Vec3::Zero(), quaternion_of(0.5 * step) * before};
    const CouplingState state = coupling_state(halfway, {Vec3::Zero(), kSteps * step}, {}, {});
    work.add(law.wrench_on_tool_W({.theta_W = state.theta_W, .w_WH = state.w_WH}).t.dot(step));
  }
  return work;
}

class PassiveCouplingLaw : public testing::TestWithParam<CouplingLawInfo> {};

// Relative tolerance of work that is integrated by the midpoint rule. On a smooth closed path, the error is far below
// the square of the step (1e-7). It is about 1e-7 where the path passes |θ| = π or the slope of the law changes.
constexpr double kQuadratureShare = 1e-5;

TEST_P(PassiveCouplingLaw, ElasticForceDoesNoWorkAlongAClosedPath) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  Random random(seed);
  for (int i = 0; i < 30; ++i) {
    const CouplingParameters c = undamped(random_parameters(random));
    const Loop handle(random, random_magnitude(random, 0.1, 5) * c.force_limit_n / c.stiffness_n_per_m);
    const Work work = work_of_force(*GetParam().make(c), handle);
    ASSERT_NEAR(work.net_j, 0, kQuadratureShare * work.gross_j) << "seed " << seed << " draw " << i;
    ASSERT_GT(work.gross_j, 0);
  }
}

TEST_P(PassiveCouplingLaw, ElasticTorqueDoesNoWorkAlongAClosedPath) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  Random random(seed);
  for (int i = 0; i < 30; ++i) {
    const CouplingParameters c = undamped(random_parameters(random));
    const Work work = work_of_torque(*GetParam().make(c), Loop(random, random.uniform(0.1, 3)));
    ASSERT_NEAR(work.net_j, 0, kQuadratureShare * work.gross_j) << "seed " << seed << " draw " << i;
    ASSERT_GT(work.gross_j, 0);
  }
}

/// A handle or tool that translates and rotates along closed paths.
struct MovingFrame {
  Loop place;
  Loop turn;

  Pose at(double s) const { return {place(s), quaternion_of(turn(s))}; }
  /// Returns the pose halfway between two poses, and the twist that moves one to the other in one unit of time.
  std::pair<Pose, Twist> between(double s, double t) const {
    const Pose a = at(s), b = at(t);
    const Twist V{b.p - a.p, rotation_vector(b.q * a.q.conjugate())};
    return {integrate(a, V, 0.5), V};
  }
};

TEST_P(PassiveCouplingLaw, CreatesNoEnergyOverAClosedPathOfBothEnds) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  Random random(seed);
  for (int i = 0; i < 30; ++i) {
    const CouplingParameters c = random_parameters(random);
    const auto law = GetParam().make(c);
    const double width_m = random_magnitude(random, 0.1, 5) * c.force_limit_n / c.stiffness_n_per_m;
    const MovingFrame handle{Loop(random, width_m), Loop(random, 1)};
    const MovingFrame tool{Loop(random, width_m), Loop(random, 1)};
    const double pace_hz = random_magnitude(random, 0.01, 10);
    Work given;
    for (int k = 0; k < kSteps; ++k) {
      const auto [X_WH, step_WH] = handle.between(static_cast<double>(k) / kSteps, (k + 1.0) / kSteps);
      const auto [X_WT, step_WT] = tool.between(static_cast<double>(k) / kSteps, (k + 1.0) / kSteps);
      const double steps_per_s = pace_hz * kSteps;
      const Twist V_WH{steps_per_s * step_WH.v, steps_per_s * step_WH.w};
      const Twist V_WT{steps_per_s * step_WT.v, steps_per_s * step_WT.w};
      const auto [on_tool, on_hand] = coupling_wrenches(*law, X_WH, V_WH, X_WT, V_WT);
      given.add(on_tool.f.dot(step_WT.v) + on_tool.t.dot(step_WT.w) + on_hand.f.dot(step_WH.v) +
                on_hand.t.dot(step_WH.w));
    }
    ASSERT_LT(given.net_j, 0) << "the damper dissipated no energy; seed " << seed << " draw " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Catalog, PassiveCouplingLaw, testing::ValuesIn(laws_that_are(true)), law_test_name);

/// Energy that the coupling stores while the handle moves from 0 to `reach_m`, and energy that it returns while the
/// handle moves back.
struct PushAndRetreat {
  double stored_j = 0;
  double returned_j = 0;
};

PushAndRetreat push_and_retreat(const CouplingLaw& law, double reach_m) {
  constexpr double kPace_m_per_s = 0.1;
  PushAndRetreat result;
  const double step_m = reach_m / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const Vec3 d_W{(k + 0.5) * step_m, 0, 0};
    const auto force = [&](double pace) { return law.wrench_on_tool_W({.d_W = d_W, .v_WH = {pace, 0, 0}}).f.x(); };
    result.stored_j += force(kPace_m_per_s) * step_m;
    result.returned_j += force(-kPace_m_per_s) * step_m;
  }
  return result;
}

class ActiveCouplingLaw : public testing::TestWithParam<CouplingLawInfo> {};

TEST_P(ActiveCouplingLaw, ReturnsMoreEnergyThanItStoredWhenTheHandReverses) {
  const std::uint64_t seed = test::test_seed(kUsualSeed);
  Random random(seed);
  for (int i = 0; i < 30; ++i) {
    const CouplingParameters c = undamped(random_parameters(random));
    // The reach is limited to the range where each curve is below the straight line of the linear spring. Beyond this
    // range, a sharp stable-dynamic curve is above the line.
    const double reach_m =
        random.uniform(0.2, 1) * c.force_limit_n / c.stiffness_n_per_m * std::min(1.0, 1 / c.curve_sharpness);
    const PushAndRetreat energy = push_and_retreat(*GetParam().make(c), reach_m);
    ASSERT_GT(energy.stored_j, 0) << "seed " << seed << " draw " << i;
    ASSERT_GT(energy.returned_j, 1.01 * energy.stored_j) << "seed " << seed << " draw " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Catalog, ActiveCouplingLaw, testing::ValuesIn(laws_that_are(false)), law_test_name);

// Example: a force limit of 4 N and a stiffness of 200 N/m, so the curves bend at 20 mm. The handle is displaced by 10
// mm and returned.
constexpr CouplingParameters kExample{.stiffness_n_per_m = 200, .damping_n_s_per_m = 0, .force_limit_n = 4};

TEST(StableDynamicLiteral, ReturnsTenMillijouleOfTheThreeOrSixThatItStored) {
  const auto law = make_coupling_law("stable-dynamic-literal", kExample);
  const PushAndRetreat blunt = push_and_retreat(*law, 0.010);
  EXPECT_NEAR(blunt.stored_j, 3.1e-3, 0.05e-3);
  EXPECT_NEAR(blunt.returned_j, 10.0e-3, 1e-6);
  // It is unclear whether the 2 in the printed formula is an exponent or a factor. The test covers both readings.
  CouplingParameters sharp = kExample;
  sharp.curve_sharpness = 2;
  law->set_parameters(sharp);
  EXPECT_NEAR(push_and_retreat(*law, 0.010).stored_j, 5.8e-3, 0.05e-3);
  EXPECT_NEAR(push_and_retreat(*law, 0.010).returned_j, 10.0e-3, 1e-6);
}

TEST(StableDynamic, ReturnsItsStoredEnergy) {
  const PushAndRetreat energy = push_and_retreat(*make_coupling_law("stable-dynamic", kExample), 0.010);
  EXPECT_NEAR(energy.stored_j, 3.1e-3, 0.05e-3);
  EXPECT_EQ(energy.returned_j, energy.stored_j);
}

TEST(QsaDynamic, ReturnsMoreThanItStored) {
  const PushAndRetreat energy = push_and_retreat(*make_coupling_law("qsa-dynamic", kExample), 0.010);
  // Closed form of the stored energy: F b (u − 1 + e^(−u)), with the force limit F = 4 N, the bend at b = 20 mm, and
  // the relative displacement u = 10 mm / b = 1/2.
  EXPECT_NEAR(energy.stored_j, 0.08 * (std::exp(-0.5) - 0.5), 1e-6);
  EXPECT_NEAR(energy.returned_j, 10.0e-3, 1e-6);
}

}  // namespace
}  // namespace tandem::haptics
