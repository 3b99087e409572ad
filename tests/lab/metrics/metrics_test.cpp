#include "lab/metrics/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace tandem::lab {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// Returns a trace with known values: 1 s of "move" at 2 N, then 3 s of "hold". During the hold, the force is 1 N plus
/// an oscillation of 0.5 N at 5 Hz. The hand's speed is a sine with an amplitude of 4 mm/s.
UserTrace known_trace() {
  devices::WayPoint move;
  move.phase = "move";
  devices::WayPoint hold;
  hold.at = seconds(1);
  hold.phase = "hold";
  UserTrace trace;
  trace.user.hand = devices::HandPath({move, hold});
  for (int i = 0; i < 4000; ++i) {
    TickSample tick;
    tick.time = milliseconds(i);
    tick.phase = i < 1000 ? 0 : 1;
    const double sine = std::sin(2 * std::numbers::pi * 5 * i / 1000.0);
    tick.displayed_D.f.z() = i < 1000 ? -2 : 1 + 0.5 * sine;
    tick.displayed_D.t.x() = 0.01;
    tick.hand_twist_D.v.y() = i < 2000 ? 1 : 0.004 * sine;
    tick.state_age = i < 100 ? Duration(-1) : milliseconds(i % 10);
    tick.round_trip = milliseconds(50);
    tick.is_clamped = i < 40;
    if (i < 7) tick.safety_faults = haptics::kSafetySlewed;
    if (i == 9) tick.safety_faults = haptics::kSafetyTooFast;
    trace.ticks.push_back(tick);
  }
  return trace;
}

TEST(UserMetrics, AreTheNumbersOfAKnownTrace) {
  const UserTrace trace = known_trace();
  // The hold contains a whole number of periods, so the mean square of 1 + 0.5 sin is 1 + 0.125.
  EXPECT_NEAR(user_metric(trace, "force_rms_n"), std::sqrt((4.0 + 3 * 1.125) / 4), 1e-12);
  EXPECT_NEAR(user_metric(trace, "force_max_n"), 2, 1e-12);
  EXPECT_NEAR(user_metric(trace, "move_force_rms_n"), 2, 1e-12);
  EXPECT_NEAR(user_metric(trace, "torque_rms_n_m"), 0.01, 1e-12);
  EXPECT_NEAR(user_metric(trace, "hold_force_mean_n"), 1, 1e-12);
  EXPECT_NEAR(user_metric(trace, "hold_force_deviation_n"), 0.5 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(user_metric(trace, "hold_speed_max_m_per_s"), 0.004, 1e-12);
  EXPECT_NEAR(user_metric(trace, "hold_speed_rms_m_per_s"), 0.004 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(user_metric(trace, "clamped_fraction"), 0.01, 1e-12);
  EXPECT_EQ(user_metric(trace, "slew_limited_ticks"), 7);
  EXPECT_EQ(user_metric(trace, "safety_fault_ticks"), 1);
  EXPECT_NEAR(user_metric(trace, "state_age_p99_ms"), 9, 1e-12);
  EXPECT_NEAR(user_metric(trace, "round_trip_mean_ms"), 50, 1e-9);
}

TEST(UserMetrics, TheHoldPhaseCountsOnlyASecondAfterEachBegin) {
  UserTrace trace = known_trace();
  EXPECT_EQ(settled_hold_ticks(trace).size(), 2000U);
  EXPECT_EQ(settled_hold_ticks(trace).front()->time, Duration(seconds(2)));
  trace.ticks[2500].phase = 0;  // interrupts the hold, which begins again after this tick
  EXPECT_EQ(settled_hold_ticks(trace).size(), 500U + 499U);
}

TEST(UserMetrics, AMetricThatDoesNotApplyIsNan) {
  UserTrace trace;
  for (const UserMetric& metric : user_metrics()) {
    const double value = metric.value_of(trace);
    EXPECT_TRUE(std::isnan(value) || value == 0) << metric.name << " is " << value;
  }
  EXPECT_TRUE(std::isnan(user_metric(trace, "hold_speed_max_m_per_s")));
}

TEST(UserMetrics, RefuseAnUnknownName) {
  EXPECT_THROW(user_metric({}, "happiness"), std::invalid_argument);
}

TEST(BodyTravel, IsTheDistanceFromTheFirstPlace) {
  SessionTrace trace;
  for (const double x : {1.0, 1.3, 1.1}) {
    BodiesSample sample;
    sample.X_WB.resize(1);
    sample.X_WB[0].p.x() = x;
    trace.bodies.push_back(sample);
  }
  const std::vector<double> travel_m = body_travel_m(trace, 0);
  ASSERT_EQ(travel_m.size(), 3U);
  EXPECT_EQ(travel_m[0], 0);
  EXPECT_NEAR(travel_m[1], 0.3, 1e-12);
  EXPECT_NEAR(travel_m[2], 0.1, 1e-12);
}

}  // namespace
}  // namespace tandem::lab
