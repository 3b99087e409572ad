// Tests the text for Prometheus: each event is counted once, histogram buckets are cumulative, and no name breaks the
// format.
#include "server/metrics/metrics_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>

namespace tandem::server {
namespace {

using proto::DropReason;

/// Returns the samples in the text. The key is a line up to its last space, the value is the rest of the line.
std::map<std::string, std::string> samples_of(const std::string& text) {
  std::map<std::string, std::string> samples;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("#")) continue;
    const std::size_t space = line.rfind(' ');
    EXPECT_TRUE(samples.emplace(line.substr(0, space), line.substr(space + 1)).second) << line << " occurs twice";
  }
  return samples;
}

MetricsSnapshot with_a_room(const std::string& name = "attic") {
  MetricsSnapshot snapshot;
  snapshot.rooms.emplace_back().name = name;
  snapshot.server.users.resize(1);
  return snapshot;
}

TEST(MetricsText, CountsEachDatagramByOneResult) {
  MetricsSnapshot snapshot = with_a_room();
  HubCounters& hub = snapshot.server.hub;
  for (const DropReason reason : {DropReason::kNone, DropReason::kNone, DropReason::kNone, DropReason::kTag,
                                  DropReason::kUnknownConnection, DropReason::kUnknownConnection})
    hub.count_received(reason);
  hub.received_drops.add(DropReason::kOverwritten);  // counts an accepted datagram, so it must not count as dropped
  const auto samples = samples_of(metrics_text(snapshot));
  EXPECT_EQ(samples.at("tandem_datagrams_received_total{result=\"accepted\"}"), "3");
  EXPECT_EQ(samples.at("tandem_datagrams_received_total{result=\"tag\"}"), "1");
  EXPECT_EQ(samples.at("tandem_datagrams_received_total{result=\"unknown_connection\"}"), "2");
  EXPECT_EQ(samples.at("tandem_datagrams_received_total{result=\"malformed\"}"), "0") << "there before it happens";
  EXPECT_EQ(samples.at("tandem_inputs_overwritten_total"), "1");
}

TEST(MetricsText, AHistogramsBucketsHoldAllBelowTheirBound) {
  MetricsSnapshot snapshot = with_a_room();
  Histogram& steps = snapshot.rooms[0].timing.step_time;
  for (const int us : {20, 80, 90, 400, 2500}) steps.record(std::chrono::microseconds(us));
  const auto samples = samples_of(metrics_text(snapshot));
  const auto bucket = [&samples](const std::string& bound) {
    return samples.at("tandem_room_step_seconds_bucket{room=\"attic\",le=\"" + bound + "\"}");
  };
  EXPECT_EQ(bucket("2.5e-05"), "1");
  EXPECT_EQ(bucket("0.0001"), "3");
  EXPECT_EQ(bucket("0.0005"), "4");
  EXPECT_EQ(bucket("0.002"), "4");
  EXPECT_EQ(bucket("0.003"), "5");
  EXPECT_EQ(bucket("+Inf"), "5");
  EXPECT_EQ(samples.at("tandem_room_step_seconds_count{room=\"attic\"}"), "5");
  EXPECT_NEAR(std::stod(samples.at("tandem_room_step_seconds_sum{room=\"attic\"}")), 3090e-6, 1e-12);
}

TEST(MetricsText, NamesEachReasonRoleAndFault) {
  MetricsSnapshot snapshot = with_a_room();
  snapshot.server.hub.refusals[wire::ERROR_TOKEN_EXPIRED] = 2;
  snapshot.server.hub.ends[wire::DISCONNECT_SILENCE] = 3;
  snapshot.server.users[0] = {4, 1, 0};
  snapshot.rooms[0].fault_steps[2] = 5;
  snapshot.rooms[0].braked_j = 0.125;
  const auto samples = samples_of(metrics_text(snapshot));
  EXPECT_EQ(samples.at("tandem_refusals_total{reason=\"token_expired\"}"), "2");
  EXPECT_EQ(samples.at("tandem_disconnects_total{reason=\"silence\"}"), "3");
  EXPECT_EQ(samples.at("tandem_users{room=\"attic\",role=\"manipulator\"}"), "4");
  EXPECT_EQ(samples.at("tandem_users{room=\"attic\",role=\"observer\"}"), "1");
  EXPECT_EQ(samples.at("tandem_room_fault_steps_total{room=\"attic\",fault=\"coupling_saturated\"}"), "5");
  EXPECT_EQ(samples.at("tandem_room_passivity_dissipated_joules_total{room=\"attic\"}"), "0.125");
}

TEST(MetricsText, ContainsRecordingAndCheckpointOnlyIfTheyExist) {
  MetricsSnapshot snapshot = with_a_room();
  EXPECT_THAT(metrics_text(snapshot), testing::Not(testing::ContainsRegex("recording|checkpoint")));
  snapshot.rooms[0].is_recorded = snapshot.has_checkpoint = true;
  snapshot.rooms[0].recorded_messages_lost = 7;
  snapshot.checkpoint_failures = 8;
  const auto samples = samples_of(metrics_text(snapshot));
  EXPECT_EQ(samples.at("tandem_recording_messages_lost_total{room=\"attic\"}"), "7");
  EXPECT_EQ(samples.at("tandem_checkpoint_failures_total"), "8");
}

TEST(MetricsText, ARoomsNameCannotBreakOutOfItsLabel) {
  const auto samples = samples_of(metrics_text(with_a_room("a\"} 1\\\n")));
  EXPECT_EQ(samples.count("tandem_room_steps_total{room=\"a\\\"} 1\\\\\\n\"}"), 1U);
}

}  // namespace
}  // namespace tandem::server
