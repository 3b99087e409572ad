// Tests that a delayed correction is applied only once, and gradually.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "client/model/input_history.hpp"
#include "client/model/reconciler.hpp"

namespace tandem::client {
namespace {

constexpr double kReconcilerPeriod_s = 1e-3;

RigidState at_x(double x_m) {
  RigidState state;
  state.X.p.x() = x_m;
  return state;
}

/// Result of a run in which a model starts `offset_m` from the server's state and moves only by corrections. The
/// server's response to a motion arrives `delay` ticks later.
struct Course {
  double end_m = 0;
  double lowest_m = 0;
  double fastest_m_per_tick = 0;
};
Course corrected(double offset_m, int delay, const ReconcilerSettings& settings, int ticks) {
  Reconciler reconciler(settings);
  double model_m = offset_m;
  std::vector<double> was{model_m};
  std::vector<Shift> given{Shift{}};
  Course run{model_m, model_m, 0};
  for (int k = 1; k <= ticks; ++k) {
    const int answered = k - delay;
    if (answered >= 0) {
      const auto then = static_cast<std::size_t>(answered);
      reconciler.observe(at_x(0), at_x(was[then]), given[then]);
    }
    const Shift shift = reconciler.step(kReconcilerPeriod_s, 0);
    model_m += shift.p.x();
    run.lowest_m = std::min(run.lowest_m, model_m);
    run.fastest_m_per_tick = std::max(run.fastest_m_per_tick, shift.p.norm());
    was.push_back(model_m);
    given.push_back(reconciler.given());
  }
  run.end_m = model_m;
  return run;
}

class ReconcilerDelay : public testing::TestWithParam<int> {};

TEST_P(ReconcilerDelay, RemovesAnOffsetOnceForAnyDelay) {
  const ReconcilerSettings settings{.time_constant_s = 0.05, .speed_limit_m_per_s = 1.0};
  const Course run = corrected(0.010, GetParam(), settings, GetParam() + 1000);
  EXPECT_NEAR(run.end_m, 0, 1e-9);
  // The offset must decrease to zero. If a correction were applied twice, the offset would become negative.
  EXPECT_GT(run.lowest_m, -1e-12);
}

TEST_P(ReconcilerDelay, NeverMovesFasterThanItsLimit) {
  const ReconcilerSettings settings{.time_constant_s = 0.01, .speed_limit_m_per_s = 0.05};
  const Course run = corrected(0.020, GetParam(), settings, GetParam() + 1000);
  EXPECT_LE(run.fastest_m_per_tick, 0.05 * kReconcilerPeriod_s * (1 + 1e-12));
  EXPECT_NEAR(run.end_m, 0, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Delays, ReconcilerDelay, testing::Values(1, 10, 100, 300));

TEST(Reconciler, LeavesDifferencesWithinItsDeadZone) {
  ReconcilerSettings settings;
  settings.dead_zone_m = 0.001;
  EXPECT_EQ(corrected(0.0009, 50, settings, 1000).end_m, 0.0009);
  EXPECT_NEAR(corrected(0.003, 50, settings, 3000).end_m, 0.001, 1e-9);
}

TEST(Reconciler, TurnsTheShortWay) {
  RigidState server;
  server.X.q = quaternion_of(Vec3(0, 0, 3.0));
  RigidState model;
  model.X.q = quaternion_of(Vec3(0, 0, -3.0));
  Reconciler reconciler{ReconcilerSettings{}};
  reconciler.observe(server, model, Shift{});
  EXPECT_LT(reconciler.step(kReconcilerPeriod_s, 0).theta.z(), 0);
}

TEST(Reconciler, IgnoresAStateThatIsNotFinite) {
  Reconciler reconciler{ReconcilerSettings{}};
  RigidState broken;
  broken.X.p.x() = std::numeric_limits<double>::quiet_NaN();
  reconciler.observe(broken, at_x(0), Shift{});
  EXPECT_EQ(reconciler.step(kReconcilerPeriod_s, 0).p.norm(), 0);
}

TEST(InputHistory, StoresAnInputUntilItsSlotIsReused) {
  InputHistory history(4, 2);
  for (std::uint64_t k = 1; k <= 5; ++k) {
    history.add(Tick{k}).tool.X.p.x() = static_cast<double>(k);
    history.bodies(Tick{k})[1].is_implicit = k == 5;
  }
  EXPECT_EQ(history.find(Tick{1}), nullptr);
  ASSERT_NE(history.find(Tick{2}), nullptr);
  EXPECT_EQ(history.find(Tick{2})->tool.X.p.x(), 2);
  EXPECT_TRUE(history.bodies(Tick{5})[1].is_implicit);
  EXPECT_FALSE(history.bodies(Tick{4})[1].is_implicit);
  EXPECT_EQ(history.find(Tick{6}), nullptr);
  EXPECT_EQ(history.find(Tick{0}), nullptr);
}

}  // namespace
}  // namespace tandem::client
