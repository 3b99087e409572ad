// Tests the limits in server/session/limits.hpp: a client with excessive requests must not affect other users.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using test::message_of;
using testing::HasSubstr;

wire::ClientControl ping() {
  return message_of([](auto& message) { message.mutable_ping()->set_token(1); });
}

wire::ClientControl force_limit(double newtons) {
  return message_of([newtons](auto& message) {
    message.mutable_set_parameter()->set_name("coupling.force_limit_n");
    message.mutable_set_parameter()->set_value(newtons);
  });
}

test::BenchClient connect_from(test::HubBench& bench, const std::string& address) {
  test::BenchClient client;
  client.handle = ++bench.last_handle;
  bench.hub->on_connected(client.handle, bench.now, address);
  return client;
}

bool is_connected(const test::HubBench& bench, const test::BenchClient& client) {
  return bench.hub->state_of(client.handle) != ConnectionState::kClosed;
}

TEST(Limits, SilentConnectionsDoNotBlockOtherUsers) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  for (int i = 0; i < 200; ++i) bench.connect();
  EXPECT_LE(bench.hub->connection_count(), 1 + kMaxHalfOpen);
  EXPECT_EQ(bench.join("ben").joined.user(), 2U) << "at once, not when they have timed out";
  EXPECT_TRUE(is_connected(bench, ada));
}

TEST(Limits, OfManyAddressesTheOneWithMostHalfOpenConnectionsMakesRoom) {
  test::HubBench bench;
  const test::BenchClient quiet = connect_from(bench, "quiet");
  for (std::size_t i = 0; i < 8 * kMaxHalfOpen; ++i) connect_from(bench, "crowd " + std::to_string(i % 8));
  EXPECT_EQ(bench.hub->connection_count(), HubSettings{}.max_connections);
  EXPECT_TRUE(is_connected(bench, quiet)) << "the oldest of all, but alone at its address";
  bench.now += std::chrono::milliseconds(2001);
  bench.hub->poll(VirtualClock(bench.now));
  EXPECT_EQ(bench.hub->connection_count(), 0U) << "no hello within 2 s";
}

TEST(Limits, OfAddressesWithAsManyTheOneThatCameFirstMakesRoom) {
  for (const char* name : {"a newcomer", "z newcomer"}) {
    test::HubBench bench;
    for (std::size_t i = 0; i < HubSettings{}.max_connections; ++i)
      connect_from(bench, "one of many " + std::to_string(i));
    const test::BenchClient newcomer = connect_from(bench, name);
    for (int i = 0; i < 30; ++i) connect_from(bench, "another " + std::to_string(i));
    EXPECT_TRUE(is_connected(bench, newcomer)) << name << ": older ones are there";
  }
}

TEST(Limits, AJoinedUserDoesNotBlockOthersFromTheSameAddress) {
  std::string scene = test::two_hands_scene();
  scene.replace(scene.find("\"observers\": 1"), 14, "\"observers\": 13");
  test::HubBench bench({}, {scene});
  std::vector<test::BenchClient> crowd;
  for (int i = 0; i < 12; ++i) crowd.push_back(bench.join("one of many", wire::ROLE_OBSERVER));
  const wire::ClientControl state = message_of([](auto& message) { message.set_state_datagram("x"); });
  // Each of 12 users at one address sends 1900 state datagrams per second as messages, which cost 95 per second. Each
  // user is within kControlRate, but together they exceed kAddressControlRate. State datagrams must not count for the
  // address.
  for (int ms = 0; ms < 20'000; ++ms) {
    for (test::BenchClient& user : crowd) {
      if (ms % 100 == 0) bench.send_state(user);
      for (int i = 0; i < 2 && ms % 20 != 0; ++i) bench.send(user, state);
    }
    bench.step();
  }
  EXPECT_TRUE(is_connected(bench, crowd.front()));
  EXPECT_EQ(bench.join("a newcomer").joined.user(), 13U);
}

TEST(Limits, ARoomIsResetOnceASecond) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR), ben = bench.join("ben");
  bench.drain(ben);
  for (int ms = 0; ms < 3000; ms += 20) {
    bench.send_state(ada);
    bench.send_state(ben);
    bench.send(ada, message_of([](auto& message) { message.mutable_reset_room(); }));
    bench.step(20);
  }
  EXPECT_TRUE(is_connected(bench, ada));
  int resets = 0;
  for (const auto& message : bench.drain(ben)) resets += message.has_room_reset() ? 1 : 0;
  EXPECT_GE(resets, 4);
  EXPECT_LE(resets, 5);
}

TEST(Limits, AFloodIsServedATurnAtATimeAndThenEnded) {
  test::HubBench bench;
  test::BenchClient eve = bench.join("eve");
  proto::Bytes flood;
  for (int i = 0; i < 5000; ++i) proto::append_frame(ping(), flood);
  bench.hub->on_control_bytes(eve.handle, flood, bench.now);
  EXPECT_LE(static_cast<double>(bench.drain(eve).size()), kConnectionTurn.at_once);
  EXPECT_TRUE(bench.hub->is_behind(eve.handle)) << "the transport reads no more of it";
  bench.step(20);
  EXPECT_FALSE(is_connected(bench, eve));
  EXPECT_FALSE(bench.hub->is_behind(eve.handle));
}

TEST(Limits, ConnectionsOfOneAddressDelayOnlyEachOther) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  std::vector<test::BenchClient> crowd;
  for (std::size_t i = 0; i < kMaxHalfOpen; ++i) bench.greet(crowd.emplace_back(connect_from(bench, "crowd")));
  test::BenchClient ben = connect_from(bench, "home");
  bench.greet(ben);
  std::size_t answered = 0;
  for (int ms = 0; ms < 2000; ++ms) {
    bench.send_state(ada);
    if (ms % 5 == 0) {  // 200 messages per second from each connection, 3200 in total
      for (const test::BenchClient& client : crowd) bench.send(client, ping());
    }
    bench.step();
    for (const test::BenchClient& client : crowd) answered += bench.drain(client).size();
  }
  EXPECT_LE(static_cast<double>(answered), kAddressControlRate.at_once + 2 * kAddressControlRate.per_second + 100);
  bench.send(ben, ping());
  EXPECT_EQ(test::described(bench.drain(ben)), "pong");
  bench.send(ada, ping());
  EXPECT_EQ(test::described(bench.drain(ada)), "pong");
}

TEST(Limits, ComingAnewDoesNotRefillAnAddress) {
  test::HubBench bench;
  int joins = 0;
  for (int i = 0; i < 1000; ++i) {
    const test::BenchClient eve = bench.join("eve");
    joins += eve.joined.user() != 0 ? 1 : 0;
    bench.hub->on_disconnected(eve.handle, bench.now);
    if (i % 4 == 3) bench.step();
  }
  EXPECT_LE(joins, (kAddressControlRate.at_once + 0.25 * kAddressControlRate.per_second) / kJoinPrice);
  EXPECT_GT(joins, 100);
}

TEST(Limits, ChangesByOthersAreMergedForASlowReader) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_OPERATOR);
  test::BenchClient slow = bench.join("slow");
  bench.drain(slow);
  bench.transport.queued = kMaxQueuedBeforeNews + 1;
  for (int i = 1; i <= 500; ++i) {
    bench.send_state(ada);
    bench.send_state(slow);
    bench.send(ada, force_limit(1 + i));
    bench.step(11);
  }
  EXPECT_EQ(test::described(bench.drain(slow)), "");
  bench.transport.queued = 0;
  bench.step();
  const auto received = bench.drain(slow);
  ASSERT_EQ(test::described(received), "parameter_set");
  EXPECT_EQ(received[0].parameter_set().value(), 501);
  EXPECT_EQ(bench.hub->user_count(), 2U);
}

TEST(Limits, AUserWhoJoinsAndLeavesMeanwhileIsNotReportedToASlowReader) {
  test::HubBench bench;
  const test::BenchClient ada = bench.join("ada");
  test::BenchClient slow = bench.join("slow", wire::ROLE_OBSERVER);
  bench.drain(slow);
  bench.transport.queued = kMaxQueuedBeforeNews + 1;
  bench.hub->on_disconnected(ada.handle, bench.now);
  test::BenchClient eve;
  for (int i = 0; i < 50; ++i) {
    if (i > 0) bench.hub->on_disconnected(eve.handle, bench.now);
    for (int ms = 0; ms < 20; ms += 10) {
      bench.send_state(slow);
      bench.step(10);
    }
    eve = bench.join("eve");
    ASSERT_NE(eve.joined.user(), 0U);
  }
  EXPECT_EQ(test::described(bench.drain(slow)), "");
  bench.transport.queued = 0;
  bench.step();
  const auto received = bench.drain(slow);
  ASSERT_EQ(test::described(received), "user_left, user_joined");
  EXPECT_EQ(received[0].user_left().user(), ada.joined.user()) << "the user who was reported before";
  EXPECT_EQ(received[1].user_joined().user(), eve.joined.user()) << "the only one of fifty users who is still joined";
}

TEST(Limits, OnlyAUserWhoFloodsWithUpdatesIsDisconnected) {
  test::HubBench bench;
  test::BenchClient eve = bench.join("eve"), ben = bench.join("ben");
  for (int ms = 0; ms < 1500; ++ms) {
    for (int i = 0; i < 20 && is_connected(bench, eve); ++i) bench.send_state(eve);
    bench.send_state(ben);
    bench.step();
  }
  EXPECT_FALSE(is_connected(bench, eve));
  EXPECT_THAT(bench.drain(eve).back().goodbye().text(), HasSubstr("at most 4000 a second"));
  EXPECT_TRUE(is_connected(bench, ben));
}

TEST(Limits, AClientsMessageIsShort) {
  test::HubBench bench;
  test::BenchClient eve = bench.connect();
  bench.send(eve, message_of([](auto& message) {
               message.mutable_hello()->set_program(std::string(proto::kMaxClientControlBytes, 'x'));
             }));
  EXPECT_EQ(test::described(bench.drain(eve)), "goodbye");
}

}  // namespace
}  // namespace tandem::server
