#include "lab/session/virtual_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/json_pretty.hpp"
#include "lab/metrics/metrics.hpp"
#include "lab/results/results.hpp"

namespace tandem::lab {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// A scene without gravity: two tools in front of a free block.
constexpr const char* kVirtualScene = R"({
  "name": "lab_test", "gravity_m_per_s2": [0, 0, 0],
  "bodies": [{"name": "block", "mass_kg": 0.3, "graspable": true,
              "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}]}],
  "tools": [{"name": "left", "placement": {"position_m": [-0.04, 0, 0]},
             "workspace": {"device_base": {"position_m": [-0.04, 0, 0]}}},
            {"name": "right", "placement": {"position_m": [0.04, 0, 0]},
             "workspace": {"device_base": {"position_m": [0.04, 0, 0]}}}],
  "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 3}
})";

// A path that moves the left tool by 60 mm to the right, through the block.
constexpr const char* kPush = R"({"points": [
  {"t_s": 0, "phase": "approach"}, {"t_s": 1, "phase": "move"},
  {"t_s": 3, "position_m": [0.06, 0, 0], "phase": "hold"}]})";

std::shared_ptr<const server::LoadedScene> scene() {
  return server::load_scene_text(kVirtualScene, "lab_test.json", "/");
}

ExperimentUser user(const std::string& name, const std::string& hand_name, const devices::HandPath& hand, int phase) {
  ExperimentUser result;
  result.name = name;
  result.hand_name = hand_name;
  result.hand = hand;
  result.up.delay = result.down.delay = milliseconds(10);
  result.tick_phase = kSlot * phase;
  return result;
}

Experiment pushing() {
  Experiment experiment;
  experiment.name = "pushing";
  experiment.scene = "lab_test.json";
  experiment.duration = seconds(3);
  experiment.users = {user("anna", "push.json", devices::parse_hand_path(kPush, "push.json"), 1),
                      user("ben", "rest", devices::named_hand_path("rest"), 2)};
  return experiment;
}

std::string results_of(const Experiment& experiment) {
  return pretty_json(results_json(experiment, run_virtual_session(experiment, scene())));
}

TEST(VirtualSession, OneUsersPushReachesTheOtherUsersHand) {
  const SessionTrace trace = run_virtual_session(pushing(), scene());
  ASSERT_EQ(trace.users.size(), 2U);
  EXPECT_TRUE(is_complete(trace));
  for (const UserTrace& each : trace.users) EXPECT_EQ(each.ticks.size(), 3000U) << each.user.name;
  EXPECT_THAT(body_travel_m(trace, 0), testing::Contains(testing::Gt(0.005)));
  EXPECT_GT(user_metric(trace.users[0], "force_max_n"), 0.3);
  EXPECT_GT(user_metric(trace.users[1], "force_max_n"), 0.3) << "ben does not move, but is pushed through the block";
}

TEST(VirtualSession, TheClientMeasuresTheConfiguredRoundTrip) {
  const SessionTrace trace = run_virtual_session(pushing(), scene());
  for (const UserTrace& each : trace.users) {
    // The virtual network rounds the delay of each direction up to a multiple of 0.25 ms. In addition, an update waits
    // up to 1 ms for the next step of the room.
    EXPECT_GE(user_metric(each, "round_trip_mean_ms"), 20.0);
    EXPECT_LE(user_metric(each, "round_trip_mean_ms"), 20.0 + 2 * 0.25 + 1e-9);
    // A new state arrives every 1 ms, so its age at a tick is at most 1 ms.
    EXPECT_LT(user_metric(each, "state_age_p99_ms"), 1.0 + 1e-9);
  }
}

TEST(VirtualSession, ALinkWithoutDelayTakesOneSlotEitherWay) {
  for (const bool over_tcp : {false, true}) {
    Experiment experiment = pushing();
    for (ExperimentUser& each : experiment.users) {
      each.state_over_tcp = over_tcp;
      each.up.delay = each.down.delay = Duration(0);
    }
    const SessionTrace trace = run_virtual_session(experiment, scene());
    for (const UserTrace& each : trace.users) {
      EXPECT_NEAR(user_metric(each, "round_trip_mean_ms"), 2 * to_seconds(kSlot) * 1e3, 1e-9) << each.user.name;
    }
  }
}

TEST(VirtualSession, TheSameSeedGivesTheSameBytes) {
  Experiment experiment = pushing();
  for (ExperimentUser& each : experiment.users) {
    each.up.jitter = each.down.jitter = milliseconds(3);
    each.up.loss = 0.02;
    each.hand_parameters.tremor_rms_n = 0.05;
  }
  const std::string first = results_of(experiment);
  EXPECT_EQ(results_of(experiment), first);
  experiment.seed = 2;
  const std::string other = results_of(experiment);
  // A measured value must differ, not only the printed seed.
  EXPECT_NE(boost::json::parse(other).at("users").at(0).at("metrics"),
            boost::json::parse(first).at("users").at(0).at("metrics"));
}

TEST(VirtualSession, UsersGetTheToolsInTheirOrderForAnyLinks) {
  Experiment experiment = pushing();
  experiment.users[0].up.delay = experiment.users[0].down.delay = milliseconds(200);
  experiment.users[1].up.delay = experiment.users[1].down.delay = milliseconds(1);
  const SessionTrace trace = run_virtual_session(experiment, scene());
  EXPECT_LT(trace.users[0].ticks.front().handle_W.X.p.x(), 0);
  EXPECT_GT(trace.users[1].ticks.front().handle_W.X.p.x(), 0);
}

TEST(VirtualSession, LostDatagramsAreCountedAndTheSessionContinues) {
  Experiment experiment = pushing();
  for (ExperimentUser& each : experiment.users) each.up.loss = each.down.loss = 0.1;
  const SessionTrace trace = run_virtual_session(experiment, scene());
  EXPECT_TRUE(is_complete(trace));
  for (const UserTrace& each : trace.users) {
    EXPECT_GT(each.link_up.lost, 0U);
    EXPECT_EQ(each.link_down.sent, each.link_down.lost + each.link_down.delivered + 10) << "10 ms of packets in flight";
    EXPECT_EQ(user_metric(each, "safety_fault_ticks"), 0);
  }
}

TEST(VirtualSession, TcpCarriesTheSameSession) {
  Experiment experiment = pushing();
  for (ExperimentUser& each : experiment.users) each.state_over_tcp = true;
  const SessionTrace trace = run_virtual_session(experiment, scene());
  EXPECT_TRUE(is_complete(trace));
  EXPECT_GT(user_metric(trace.users[1], "force_max_n"), 0.3);
  EXPECT_EQ(trace.users[0].link_up.sent, 0U) << "no datagram of its own";
}

TEST(VirtualSession, ReportsWhyAUserLostTheConnection) {
  Experiment experiment = pushing();
  experiment.users[0].down.loss = 0.95;
  experiment.users[0].down.mean_bad_period = seconds(10);
  experiment.users[0].up = experiment.users[0].down;
  const SessionTrace trace = run_virtual_session(experiment, scene());
  EXPECT_FALSE(trace.users[0].stayed_connected);
  EXPECT_NE(trace.users[0].why_disconnected, "");
  EXPECT_TRUE(trace.users[1].stayed_connected);
  EXPECT_NE(results_json(experiment, trace).at("outcome").as_string(), "completed");
}

TEST(VirtualSession, RefusesMoreManipulatorsThanTools) {
  Experiment experiment = pushing();
  experiment.users.push_back(user("cleo", "rest", devices::named_hand_path("rest"), 3));
  EXPECT_THAT([&] { run_virtual_session(experiment, scene()); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("3 manipulators")));
  experiment.users.back().role = server::UserRole::kObserver;
  const SessionTrace trace = run_virtual_session(experiment, scene());
  EXPECT_EQ(user_metric(trace.users[2], "force_max_n"), 0) << "an observer must have no force";
}

TEST(VirtualSession, AHandOnAnotherDeviceHasThatDevicesLimits) {
  Experiment experiment = pushing();
  devices::DeviceProfile& device = experiment.users[0].device;
  device = devices::find_device_profile("touch");
  device.spec.force_limit_n = 0.3;
  const SessionTrace trace = run_virtual_session(experiment, scene());
  EXPECT_LE(user_metric(trace.users[0], "force_max_n"), 0.3 * (1 + 1e-12));
  EXPECT_GT(user_metric(trace.users[0], "force_max_n"), 0.29) << "it would be shown more";
  for (const TickSample& tick : trace.users[0].ticks) ASSERT_EQ(tick.displayed_D.t.norm(), 0) << "it shows no torque";
  const boost::json::object results = results_json(experiment, trace);
  EXPECT_EQ(results.at("users").at(0).at("parameters").at("device").as_string(), "touch");
  EXPECT_EQ(results.at("users").at(1).at("parameters").at("device").as_string(), "sim");
}

TEST(VirtualSession, TheResultsNameEveryMetricAndParameter) {
  const Experiment experiment = pushing();
  const SessionTrace trace = run_virtual_session(experiment, scene());
  const boost::json::object results = results_json(experiment, trace);
  for (const auto& each : results.at("users").as_array()) {
    for (const UserMetric& metric : user_metrics()) {
      EXPECT_TRUE(each.at("metrics").as_object().contains(metric.name)) << metric.name;
    }
    EXPECT_EQ(each.at("parameters").at("uplink").at("rtt_ms").as_double(), 20);
  }
  EXPECT_EQ(results.at("seed").as_uint64(), 1U);
  EXPECT_EQ(results.at("bodies").at(0).at("name").as_string(), "block");
}

TEST(VirtualSession, HandsStartAtAWholeMillisecondForAnyLinks) {
  for (const int delay_us : {0, 250, 500, 7750}) {
    Experiment experiment = pushing();
    for (ExperimentUser& each : experiment.users) each.up.delay = each.down.delay = std::chrono::microseconds(delay_us);
    const SessionTrace trace = run_virtual_session(experiment, scene());
    EXPECT_EQ(trace.joined_after % kHapticPeriod, Duration(0));
    EXPECT_EQ(trace.users[0].ticks.front().time, kSlot) << "ticks of two trials must have equal times";
    EXPECT_EQ(trace.users[1].ticks.front().time, 2 * kSlot);
  }
}

TEST(VirtualSession, TrafficCountsBothWaysAndWhatIsLost) {
  Experiment experiment = pushing();
  for (ExperimentUser& each : experiment.users) each.up.loss = each.down.loss = 0.3;
  const SessionTrace trace = run_virtual_session(experiment, scene());
  for (const UserTrace& each : trace.users) {
    EXPECT_NEAR(static_cast<double>(each.traffic.datagrams), 2 * 3000, 2);
    EXPECT_GT(each.traffic.bytes, 6000U * 40);
  }
}

TEST(VirtualSession, UsersSeeTheBodyThatHandsCanHold) {
  const SessionTrace trace = run_virtual_session(pushing(), scene());
  ASSERT_TRUE(trace.watched_body.has_value());
  EXPECT_EQ(trace.body_names[*trace.watched_body], "block");
  for (const UserTrace& each : trace.users) {
    EXPECT_TRUE(each.ticks.back().has_view) << each.user.name;
    // The block still moves after the push. The user sees its position of 10 ms ago, which may differ from the current
    // one by up to 20 mm.
    EXPECT_NEAR((each.ticks.back().view_W - trace.bodies.back().X_WB[0].p).norm(), 0, 0.02);
  }
  Experiment elsewhere = pushing();
  elsewhere.outcome = {"moon", 1, "hold"};
  EXPECT_THAT([&] { run_virtual_session(elsewhere, scene()); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("outcome.body is \"moon\"")));
}

TEST(VirtualSession, TheBodiesTableHasARowASampleFromStartToEnd) {
  const SessionTrace trace = run_virtual_session(pushing(), scene());
  const std::string csv = bodies_csv(trace);
  EXPECT_THAT(csv, testing::StartsWith("t_s,field_energy_kj_per_mol,block_x_m,block_y_m,block_z_m,"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 301);
}

}  // namespace
}  // namespace tandem::lab
