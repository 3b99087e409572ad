// Tests sources of signals: their permissions, the messages that they receive, and their rate limits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/room/room_seats.hpp"
#include "tests/server/goals/game_room.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string scene_with_valence() {
  return small_game(R"({"signals": [{"name": "valence", "states": [{"name": "positive", "above": 0}]}], "levels": [
      {"name": "a", "goals": [{"name": "g", "conditions": [{"held": {"body": "ball"}}]}]}]})");
}

wire::ClientControl signal(const std::string& name, double value, double confidence = 1, double age_s = 0) {
  return test::message_of([&](auto& message) {
    message.mutable_signal()->set_name(name);
    message.mutable_signal()->set_value(value);
    message.mutable_signal()->set_confidence(confidence);
    message.mutable_signal()->set_age_s(age_s);
  });
}

struct SignalBench : test::HubBench {
  SignalBench() : HubBench({}, {scene_with_valence()}) {}
  const SignalStatus& status() const { return rooms.front()->game()->status().signals[0]; }
};

TEST(SessionSignals, AValueReachesTheGameAndItsUsers) {
  SignalBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient source = bench.join("eeg", wire::ROLE_SIGNAL);
  EXPECT_THAT(source.joined.signals(), ElementsAre("valence"));
  EXPECT_FALSE(source.joined.has_scene());
  bench.step(5);
  bench.drain(ada);
  bench.send(source, signal("valence", 0.5, 0.9, 0.1));
  bench.step();
  EXPECT_TRUE(bench.status().is_fresh);
  EXPECT_EQ(bench.status().value, 0.5);
  EXPECT_EQ(bench.status().age_steps, 101U) << "100 ms at the source, and one step";
  bench.step(2);
  std::vector<wire::GameState> states;
  for (const auto& message : bench.drain(ada)) {
    if (message.has_game_state()) states.push_back(message.game_state());
  }
  ASSERT_FALSE(states.empty());
  ASSERT_EQ(states.back().signals_size(), 1);
  EXPECT_TRUE(states.back().signals(0).fresh());
  EXPECT_EQ(states.back().signals(0).value(), 0.5);
  EXPECT_EQ(states.back().signals(0).state(), 1U);
}

TEST(SessionSignals, ASourceHasNoSeatAndReceivesNothingOfTheRoom) {
  SignalBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.drain(ada);
  std::vector<test::BenchClient> sources;
  for (std::size_t i = 0; i < kMaxSignalSources; ++i) {
    sources.push_back(bench.join("source", wire::ROLE_SIGNAL));
    bench.step(2);  // waits until the hub processes the next messages, which it delays because of the cost of a join
  }
  EXPECT_EQ(bench.join("one more", wire::ROLE_SIGNAL).joined.user(), 0U);
  bench.step(2);
  EXPECT_NE(bench.join("ben").joined.user(), 0U) << "sources take no seat";
  EXPECT_EQ(bench.hub->users_in(0)[0], 2U);
  EXPECT_EQ(bench.hub->user_count(), 2U) << "sources are not users";
  bench.step(50);
  for (const test::BenchClient& source : sources) {
    EXPECT_TRUE(bench.drain(source).empty());
    EXPECT_TRUE(bench.drain_datagrams(source).empty());
  }
  for (const auto& message : bench.drain(ada)) {
    if (!message.has_user_joined()) continue;
    EXPECT_EQ(message.user_joined().name(), "ben") << "sources are not users";
  }
  bench.hub->on_disconnected(sources[0].handle, bench.now);
  EXPECT_NE(bench.join("one more", wire::ROLE_SIGNAL).joined.user(), 0U) << "a place is free again";
}

TEST(SessionSignals, ASourceMayDoNothingElse) {
  SignalBench bench;
  test::BenchClient ada = bench.join("ada");
  test::BenchClient source = bench.join("eeg", wire::ROLE_SIGNAL);
  const auto* fields = wire::ClientControl::descriptor()->FindOneofByName("message");
  for (int i = 0; i < fields->field_count(); ++i) {
    const auto& field = *fields->field(i);
    if (field.name() == "signal" || field.name() == "leave" || field.name() == "hello" || field.name() == "join")
      continue;
    SCOPED_TRACE(field.name());
    wire::ClientControl message;
    message.set_request(9);
    if (field.name() == "state_datagram") {
      message.set_state_datagram("x");
    } else {
      message.GetReflection()->MutableMessage(&message, &field);
    }
    bench.send(source, message);
    bench.step();
    const std::string sent = test::described(bench.drain(source));
    EXPECT_EQ(sent, field.name() == "ping" ? "pong" : "error ERROR_NOT_ALLOWED");
  }
  EXPECT_EQ(bench.send_state(source), 0U) << "a datagram is dropped";
  EXPECT_EQ(bench.hub->state_of(source.handle), ConnectionState::kActive);
  EXPECT_TRUE(bench.hub->path_challenge(source.handle, 1, bench.now).empty());
}

TEST(SessionSignals, OtherUsersMayNotSendSignals) {
  SignalBench bench;
  for (const wire::Role role : {wire::ROLE_MANIPULATOR, wire::ROLE_OPERATOR}) {
    test::BenchClient user = bench.join("ada", role);
    bench.drain(user);
    bench.send(user, signal("valence", 1));
    EXPECT_EQ(test::described(bench.drain(user)), "error ERROR_NOT_ALLOWED");
  }
  bench.step();
  EXPECT_FALSE(bench.status().has_value);
}

TEST(SessionSignals, NamesAndNumbersAreChecked) {
  SignalBench bench;
  const test::BenchClient ada = bench.join("ada");
  test::BenchClient source = bench.join("eeg", wire::ROLE_SIGNAL);
  bench.send(source, signal("arousal", 1));
  const auto unknown = bench.drain(source);
  ASSERT_EQ(test::described(unknown), "error ERROR_UNKNOWN_PARAMETER");
  EXPECT_THAT(unknown[0].error().text(), HasSubstr("it has valence"));
  for (const auto& wrong : {signal("valence", 1e7), signal("valence", 0, 1.1), signal("valence", 0, -0.1),
                            signal("valence", 0, 1, -1), signal("valence", 0, 1, 601)}) {
    bench.send(source, wrong);
    EXPECT_EQ(test::described(bench.drain(source)), "error ERROR_BAD_VALUE");
  }
  bench.step();
  EXPECT_FALSE(bench.status().has_value);
}

TEST(SessionSignals, ValuesBeyondTheRateAreDropped) {
  SignalBench bench;
  const test::BenchClient ada = bench.join("ada");
  test::BenchClient source = bench.join("eeg", wire::ROLE_SIGNAL);
  for (int i = 0; i < 120; ++i) bench.send(source, signal("valence", i));
  bench.step(10);
  EXPECT_EQ(bench.status().value, 99) << "a hundred at once";
  EXPECT_EQ(bench.drain(source).size(), 20U);
  bench.now += std::chrono::seconds(1);
  bench.send(source, signal("valence", 7));
  bench.step();
  EXPECT_EQ(bench.status().value, 7);
}

TEST(SessionSignals, ARoomWithoutSignalsHasNoSources) {
  test::HubBench bench;
  test::BenchClient client = bench.connect();
  bench.greet(client);
  bench.send(client, test::HubBench::join_message("eeg", wire::ROLE_SIGNAL));
  const auto sent = bench.drain(client);
  EXPECT_EQ(test::described(sent), "error ERROR_NOT_ALLOWED, goodbye");
  EXPECT_THAT(sent[0].error().text(), HasSubstr("game.signals"));
}

TEST(SessionSignals, ASilentSourceIsEnded) {
  SignalBench bench;
  test::BenchClient source = bench.join("eeg", wire::ROLE_SIGNAL);
  for (int i = 0; i < 3000 && bench.hub->state_of(source.handle) == ConnectionState::kActive; ++i) bench.step();
  EXPECT_EQ(bench.hub->state_of(source.handle), ConnectionState::kClosed);
  EXPECT_NE(bench.join("eeg", wire::ROLE_SIGNAL).joined.user(), 0U);
}

}  // namespace
}  // namespace tandem::server
