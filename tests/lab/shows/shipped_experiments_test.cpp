// Tests that the shipped experiments give the results stated in their descriptions. At a round trip of 50 ms, two users
// touch a peg together and dock two helices. With the stage "late-pose" the hands are calm, with the stage "hold" they
// oscillate. In other experiments, users lift and push boxes, and touch a bunny.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "common/base/json_pretty.hpp"
#include "devices/sim/sim_device.hpp"
#include "lab/metrics/metrics.hpp"
#include "lab/results/results.hpp"
#include "lab/session/virtual_session.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::lab {
namespace {

Experiment shipped(const std::string& name) {
  return load_experiment(test::source_path("lab/experiments") / (name + ".json"));
}

SessionTrace run(Experiment experiment, const std::string& stage) {
  for (ExperimentUser& user : experiment.users) user.pipeline.stage = stage;
  return run_virtual_session(experiment, server::load_scene(experiment.scene));
}

class SharedTouch : public testing::TestWithParam<const char*> {};

TEST_P(SharedTouch, IsFeltByBothAndCalmWithLatePose) {
  const SessionTrace trace = run(shipped(GetParam()), "late-pose");
  EXPECT_TRUE(is_complete(trace));
  for (const UserTrace& user : trace.users) {
    EXPECT_GE(user_metric(user, "hold_force_mean_n"), 0.5) << user.user.name;
    EXPECT_LE(user_metric(user, "hold_force_mean_n"), 3.0) << user.user.name;
    EXPECT_LE(user_metric(user, "hold_speed_max_m_per_s"), 0.005) << user.user.name;
    EXPECT_LT(user_metric(user, "clamped_fraction"), 0.01) << user.user.name;
    EXPECT_EQ(user_metric(user, "safety_fault_ticks"), 0) << user.user.name;
    EXPECT_NEAR(user_metric(user, "round_trip_mean_ms"), 50, 1) << user.user.name;
  }
}

TEST_P(SharedTouch, RingsWithHold) {
  const SessionTrace trace = run(shipped(GetParam()), "hold");
  for (const UserTrace& user : trace.users) {
    EXPECT_GT(user_metric(user, "hold_speed_max_m_per_s"), 0.020) << user.user.name;
  }
}

TEST_P(SharedTouch, IsReproducibleToTheByte) {
  const Experiment experiment = shipped(GetParam());
  EXPECT_EQ(pretty_json(results_json(experiment, run(experiment, "late-pose"))),
            pretty_json(results_json(experiment, run(experiment, "late-pose"))));
}

INSTANTIATE_TEST_SUITE_P(Experiments, SharedTouch, testing::Values("peg_two_users", "docking_two_users"),
                         [](const auto& experiment) { return std::string(experiment.param); });

TEST(PegTwoUsers, ThePegStandsInTheHoleWhileTheyPress) {
  const SessionTrace trace = run(shipped("peg_two_users"), "late-pose");
  const auto sample = std::find_if(trace.bodies.begin(), trace.bodies.end(),
                                   [](const BodiesSample& each) { return each.time >= from_seconds(8); });
  ASSERT_NE(sample, trace.bodies.end());
  const auto peg = std::find(trace.body_names.begin(), trace.body_names.end(), "peg") - trace.body_names.begin();
  const Vec3 p = sample->X_WB[static_cast<std::size_t>(peg)].p;
  // The hole is centred at x = 60 mm and leaves a clearance of 0.75 mm on each side. The ground is at z = 0, half the
  // peg's length below its centre. The physics engine lets bodies overlap by up to 1 mm under load.
  EXPECT_NEAR(p.x(), 0.060, 0.00175);
  EXPECT_NEAR(p.y(), 0, 0.00175);
  EXPECT_NEAR(p.z(), 0.030, 0.001);
}

Vec3 where_the_peg_ends(const SessionTrace& trace) {
  const auto peg = std::find(trace.body_names.begin(), trace.body_names.end(), "peg") - trace.body_names.begin();
  return trace.bodies.back().X_WB[static_cast<std::size_t>(peg)].p;
}

TEST(PegSmallDevice, TwoDevicesOfTenCentimetresHandThePegOverAndPutItIntoItsHole) {
  Experiment experiment = shipped("peg_small_device");
  const SessionTrace trace = run(experiment, "local-model");
  ASSERT_TRUE(is_complete(trace));
  EXPECT_LT((where_the_peg_ends(trace) - Vec3(0.06, 0, 0.03)).norm(), 0.002);
  for (const UserTrace& user : trace.users) {
    double farthest_m = 0;
    for (const TickSample& tick : user.ticks) farthest_m = std::max(farthest_m, tick.hand_D.p.cwiseAbs().maxCoeff());
    EXPECT_LT(farthest_m, 0.0508) << user.user.name << " stays within the device";
    EXPECT_EQ(user_metric(user, "safety_fault_ticks"), 0) << user.user.name;
  }
  // At half the motion scale, rate control at the border of the workspace is too slow to reach the hole in time.
  for (ExperimentUser& user : experiment.users) user.motion_scale = 0.5;
  EXPECT_GT((where_the_peg_ends(run(experiment, "local-model")) - Vec3(0.06, 0, 0.03)).norm(), 0.002);
}

constexpr double kGravity = 9.81;

Vec3 place(const SessionTrace& trace, const std::string& body, double at_s) {
  const auto index = std::find(trace.body_names.begin(), trace.body_names.end(), body) - trace.body_names.begin();
  const auto sample = std::find_if(trace.bodies.begin(), trace.bodies.end(),
                                   [&](const BodiesSample& each) { return each.time >= from_seconds(at_s); });
  if (sample == trace.bodies.end()) throw std::invalid_argument("the trace ends before then");
  return sample->X_WB.at(static_cast<std::size_t>(index)).p;
}

void expect_calm_hold(const UserTrace& user) {
  EXPECT_LE(user_metric(user, "hold_speed_max_m_per_s"), 0.020) << user.user.name;
  EXPECT_LT(user_metric(user, "force_max_n"), devices::SimDevice::default_spec().force_limit_n) << user.user.name;
  EXPECT_EQ(user_metric(user, "clamped_fraction"), 0) << user.user.name;
  EXPECT_EQ(user_metric(user, "safety_fault_ticks"), 0) << user.user.name;
}

/// Checks that the user holds the body and feels its weight throughout the settled hold, and has released it at the
/// end.
void expect_holds(const UserTrace& user, double mass_kg) {
  for (const TickSample* tick : settled_hold_ticks(user)) ASSERT_TRUE(tick->held_body.is_valid()) << user.user.name;
  EXPECT_FALSE(user.ticks.back().held_body.is_valid()) << user.user.name;
  EXPECT_NEAR(user_metric(user, "hold_force_mean_n"), mass_kg * kGravity, 0.05 * mass_kg * kGravity);
  expect_calm_hold(user);
}

TEST(TwoBoxesLift, EachHandFeelsTheWeightOfTheBoxItHoldsUpAndSetsItDown) {
  const SessionTrace trace = run(shipped("two_boxes_lift"), "late-pose");
  ASSERT_TRUE(is_complete(trace));
  expect_holds(trace.users.at(0), 0.2);
  expect_holds(trace.users.at(1), 0.5);
  for (const char* box : {"light_box", "heavy_box"}) {
    EXPECT_GE(place(trace, box, 7).z() - place(trace, box, 0).z(), 0.030) << box;
    EXPECT_NEAR(place(trace, box, 11.5).z(), 0.025, 0.0005) << box << " must be on the table again";
  }
}

TEST(BunnyTouch, OnePressesOnTheBunnyAndTheOtherHoldsTheBall) {
  const SessionTrace trace = run(shipped("bunny_touch"), "late-pose");
  ASSERT_TRUE(is_complete(trace));
  EXPECT_GE(user_metric(trace.users.at(0), "hold_force_mean_n"), 0.5);
  expect_calm_hold(trace.users.at(0));
  expect_holds(trace.users.at(1), 0.05);
  EXPECT_GE(place(trace, "ball", 7).z() - place(trace, "ball", 0).z(), 0.030);
}

SessionTrace two_boxes_with(const char* first_hand, const char* second_hand) {
  Experiment experiment = shipped("two_boxes_lift");
  experiment.users.at(0).hand = devices::named_hand_path(first_hand);
  experiment.users.at(1).hand = devices::named_hand_path(second_hand);
  return run(experiment, "late-pose");
}

TEST(TwoBoxes, EitherToolPushesItsBoxEitherWay) {
  const SessionTrace together = two_boxes_with("push-right", "push-left");
  EXPECT_GE(place(together, "light_box", 11.5).x(), -0.080 + 0.010);
  EXPECT_LE(place(together, "heavy_box", 11.5).x(), 0.080 - 0.010);
  const SessionTrace apart = two_boxes_with("push-left", "push-right");
  EXPECT_LE(place(apart, "light_box", 11.5).x(), -0.080 - 0.010);
  EXPECT_GE(place(apart, "heavy_box", 11.5).x(), 0.080 + 0.010);
}

TEST(TwoBoxes, EitherToolPressesOnItsBox) {
  const SessionTrace trace = two_boxes_with("press-down", "press-down");
  for (const UserTrace& user : trace.users) {
    EXPECT_GE(user_metric(user, "hold_force_mean_n"), 1.0) << user.user.name;
    expect_calm_hold(user);
  }
}

}  // namespace
}  // namespace tandem::lab
