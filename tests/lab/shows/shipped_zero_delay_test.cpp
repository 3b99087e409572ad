// Tests the shipped experiments without delay: every hand must press calmly with the intended force. A cube is lifted
// by friction alone, a peg is handed over, and a tool slides off an edge. At a round trip of 100 ms, the cube must fall
// unless a stage compensates the delay.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "lab/metrics/metrics.hpp"
#include "lab/results/results.hpp"
#include "lab/session/virtual_session.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::lab {
namespace {

constexpr double kShippedZeroDelayGravity = 9.81;

/// Runs the hands of a shipped experiment with a baseline stage and a perfect link.
SessionTrace run(const std::string& name, const std::string& stage = "late-pose", double round_trip_ms = 0) {
  Experiment experiment = load_experiment(test::source_path("lab/experiments") / (name + ".json"));
  for (ExperimentUser& user : experiment.users) {
    user.pipeline.stage = stage;
    user.pipeline.passivity = false;
    user.up.delay = user.down.delay = from_seconds(round_trip_ms / 2000);
  }
  return run_virtual_session(experiment, load_experiment_scene(experiment));
}

Vec3 place_then(const SessionTrace& trace, const std::string& body, double at_s) {
  const auto index = std::find(trace.body_names.begin(), trace.body_names.end(), body) - trace.body_names.begin();
  const auto sample = std::find_if(trace.bodies.begin(), trace.bodies.end(),
                                   [&](const BodiesSample& each) { return each.time >= from_seconds(at_s); });
  if (sample == trace.bodies.end()) throw std::invalid_argument("the trace ends before then");
  return sample->X_WB.at(static_cast<std::size_t>(index)).p;
}

struct HoldForces {
  const char* experiment;
  std::vector<double> of_users_n;
};

/// Expected magnitude of the force on each hand in its hold phase [N]. The path stretches springs in series: the hand
/// with 200 N/m, the coupling with 500 N/m, and the compliance of the touched body. The carried weight and the force of
/// the field are added. In "squeeze", 3.6 N act sideways and half of the cube's weight of 2.94 N, 1.47 N, downwards:
/// √(3.6² + 1.47²) N = 3.89 N.
const HoldForces kHoldForces[] = {{"free", {0}},
                                  {"wall", {4}},
                                  {"curve", {2}},
                                  {"rim", {3}},
                                  {"bunny", {2.15}},
                                  {"push", {4}},
                                  {"mass", {1.96}},
                                  {"squeeze", {3.89, 3.89}},
                                  {"squeeze_slippery", {3.89, 3.89}},
                                  {"peg", {0.59, 3.25}},
                                  {"soft", {2.32}},
                                  {"docking", {0.8, 0.8}}};

class WithoutDelay : public testing::TestWithParam<HoldForces> {};

TEST_P(WithoutDelay, HandsFeelTheForceThatTheirPathMeansAndHoldStill) {
  const SessionTrace trace = run(GetParam().experiment);
  ASSERT_TRUE(is_complete(trace));
  ASSERT_EQ(trace.users.size(), GetParam().of_users_n.size());
  for (std::size_t i = 0; i < trace.users.size(); ++i) {
    const UserTrace& user = trace.users[i];
    EXPECT_NEAR(user_metric(user, "hold_force_mean_n"), GetParam().of_users_n[i], 0.05) << user.user.name;
    EXPECT_LE(user_metric(user, "hold_speed_max_m_per_s"), 0.001) << user.user.name;
    EXPECT_EQ(user_metric(user, "slew_limited_ticks"), 0) << user.user.name;
    EXPECT_EQ(user_metric(user, "safety_fault_ticks"), 0) << user.user.name;
    EXPECT_EQ(user_metric(user, "clamped_fraction"), 0) << user.user.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Experiments, WithoutDelay, testing::ValuesIn(kHoldForces),
                         [](const auto& forces) { return std::string(forces.param.experiment); });

/// Returns the smallest and the largest height of a body above its start, from `from_s` to `to_s`.
std::pair<double, double> heights(const SessionTrace& trace, const std::string& body, double from_s, double to_s) {
  std::pair<double, double> result{1e9, -1e9};
  for (double t = from_s; t <= to_s; t += 0.05) {
    const double height = (place_then(trace, body, t) - place_then(trace, body, 0)).z();
    result = {std::min(result.first, height), std::max(result.second, height)};
  }
  return result;
}

// The hold phase lasts from 7.8 to 11.3 s. The cube is set down at 13.3 s and released at 14.6 s.
TEST(Squeeze, IsLiftedByFrictionCarriedAndSetDownWithoutDelay) {
  const SessionTrace trace = run("squeeze");
  const auto [least, greatest] = heights(trace, "cube", 7.8, 11.3);
  EXPECT_GE(least, 0.04);
  EXPECT_LE(greatest - least, 0.0005) << "it slips";
  EXPECT_NEAR((place_then(trace, "cube", 15.4) - place_then(trace, "cube", 0) - Vec3(0.1, 0, 0)).norm(), 0, 0.001);
  for (const UserTrace& user : trace.users) {
    for (const TickSample* tick : settled_hold_ticks(user)) {
      ASSERT_NEAR(std::abs(tick->displayed_D.f.y()), 3.6, 0.2) << user.user.name;
      ASSERT_NEAR(-tick->displayed_D.f.z(), 0.3 * kShippedZeroDelayGravity / 2, 0.05) << user.user.name;
    }
  }
}

TEST(Squeeze, IsDroppedByHandsThatAreShownLateForces) {
  for (const char* stage : {"late-pose", "hold"}) {
    const SessionTrace trace = run("squeeze", stage, 100);
    EXPECT_LE(heights(trace, "cube", 10, 11.3).first, 0.01) << stage;
  }
}

// Each hand presses with 3.6 N. By Coulomb's law, a contact with µ = 0.5 carries at most 1.8 N, so both contacts carry
// 3.6 N. The weight of the cube is 2.94 N, so the margin is small.
TEST(SqueezeSlippery, IsLiftedWithoutDelayAndDroppedWithIt) {
  EXPECT_GE(heights(run("squeeze_slippery"), "cube", 6.3, 8.8).first, 0.01);
  for (const char* stage : {"late-pose", "hold"}) {
    const SessionTrace trace = run("squeeze_slippery", stage, 100);
    EXPECT_LE(heights(trace, "cube", 6.3, 8.8).first, 0.005) << stage;
  }
}

TEST(Peg, IsHandedOverAndStandsInTheHoleAtTheEnd) {
  const SessionTrace trace = run("peg");
  ASSERT_TRUE(is_complete(trace));
  const auto holds = [&](std::size_t user, double at_s) {
    const auto& ticks = trace.users.at(user).ticks;
    const auto tick = std::find_if(ticks.begin(), ticks.end(),
                                   [&](const TickSample& each) { return each.time >= from_seconds(at_s); });
    return tick != ticks.end() && tick->held_body.is_valid();
  };
  EXPECT_TRUE(holds(0, 7) && !holds(1, 7)) << "anna alone";
  EXPECT_TRUE(holds(0, 8.8) && holds(1, 8.8)) << "both";
  EXPECT_TRUE(!holds(0, 9.7) && holds(1, 9.7)) << "ben alone";
  EXPECT_TRUE(!holds(0, 19.5) && !holds(1, 19.5)) << "neither of them";
  // The hole is centred at x = 60 mm and leaves a clearance of 0.75 mm. The peg stands on the table, with its centre 30
  // mm above it.
  const Vec3 p = place_then(trace, "peg", 19.5);
  EXPECT_NEAR(p.x(), 0.060, 0.001);
  EXPECT_NEAR(p.y(), 0, 0.001);
  EXPECT_NEAR(p.z(), 0.030, 0.0005);
}

TEST(Rim, TheToolDropsOffTheEdgeIntoTheAirAndIntoTheHoleOntoTheGround) {
  const SessionTrace trace = run("rim");
  const auto& ticks = trace.users.at(0).ticks;
  const auto at = [&](double at_s) -> const TickSample& { return ticks.at(static_cast<std::size_t>(at_s * 1000)); };
  EXPECT_NEAR(at(1.5).tool_W.p.z(), 0.035, 0.001) << "on the plate";
  EXPECT_LT(at(3.1).displayed_D.f.norm(), 0.05) << "beyond the edge of the plate there must be no force";
  EXPECT_NEAR(at(11).tool_W.p.z(), 0.005, 0.001) << "on the ground of the hole";
}

}  // namespace
}  // namespace tandem::lab
