#include "client/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <span>

#include "tests/support/back_to_back.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

TEST(ClientSession, PublishesTheSceneOfEachJoinAsANewGeneration) {
  SessionBench bench;
  bench.join();
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  const HapticScene first = bench.mailboxes.scene.front();
  EXPECT_EQ(first.generation, 1U);
  EXPECT_TRUE(first.may_display);
  EXPECT_EQ(first.workspace.X_WD.p, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(first.workspace.position_scale, 2.0);
  EXPECT_EQ(first.workspace.force_scale, 0.5);
  EXPECT_EQ(first.coupling.stiffness_n_per_m, 1.0);
  bench.session.on_disconnected(bench.now, "cut");
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_FALSE(bench.mailboxes.scene.front().may_display) << "forces end with the connection";
  EXPECT_FALSE(bench.mailboxes.scene.front().may_drive);
  EXPECT_EQ(bench.mailboxes.scene.front().generation, 1U);
  bench.wait(std::chrono::milliseconds(250));
  bench.join();
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_EQ(bench.mailboxes.scene.front().generation, 2U);
  EXPECT_TRUE(bench.mailboxes.scene.front().may_display);
  EXPECT_EQ(bench.session.counters().reconnects, 1U);
}

TEST(ClientSession, RefusesEveryHostileSceneByFieldAndNeverShowsIt) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  using Change = std::function<void(wire::Joined&)>;
  const std::pair<std::string, Change> changes[] = {
      {"force_scale", [](auto& j) { j.mutable_scene()->mutable_tools(0)->mutable_workspace()->set_force_scale(1e30); }},
      {"force_scale", [](auto& j) { j.mutable_scene()->mutable_tools(0)->mutable_workspace()->clear_force_scale(); }},
      {"position_scale",
       [](auto& j) { j.mutable_scene()->mutable_tools(0)->mutable_workspace()->set_position_scale(-1); }},
      {"position_m",
       [](auto& j) {
         j.mutable_scene()->mutable_tools(0)->mutable_workspace()->mutable_device_base()->add_position_m(1);
       }},
      {"position_m",
       [](auto& j) {
         j.mutable_scene()->mutable_tools(0)->mutable_workspace()->mutable_device_base()->set_position_m(1, 1e9);
       }},
      {"stiffness_n_per_m", [](auto& j) { j.mutable_scene()->mutable_coupling()->set_stiffness_n_per_m(1e9); }},
      {"force_limit_n", [](auto& j) { j.mutable_scene()->mutable_coupling()->clear_force_limit_n(); }},
      {"damping_n_s_per_m", [](auto& j) { j.mutable_scene()->mutable_coupling()->set_damping_n_s_per_m(-1); }},
      {"law", [](auto& j) { j.mutable_scene()->mutable_coupling()->set_law("magnet"); }},
      {"tool", [](auto& j) { j.set_tool(1); }},
      {"user", [](auto& j) { j.set_user(0); }},
      {"role", [](auto& j) { j.set_role(wire::ROLE_OBSERVER); }},
      {"bodies",
       [](auto& j) {
         for (std::size_t i = 0; i <= kMaxBodies; ++i) j.mutable_scene()->add_bodies();
       }},
  };
  for (const auto& [field, change] : changes) {
    SCOPED_TRACE(field);
    wire::Joined joined = minimal_joined();
    change(joined);
    SessionBench bench;
    bench.join(joined);
    EXPECT_EQ(bench.state(), "ended");
    EXPECT_TRUE(bench.session.status().is_setup_error);
    EXPECT_THAT(bench.session.status().why, HasSubstr(field));
    EXPECT_FALSE(bench.mailboxes.scene.poll());
  }
  wire::Joined not_a_number = minimal_joined();
  not_a_number.mutable_scene()->mutable_coupling()->set_force_limit_n(nan);
  SessionBench bench;
  bench.join(not_a_number);
  EXPECT_EQ(bench.state(), "ended");
}

TEST(ClientSession, AnObserverSendsThatItIsThereAndNothingThatMoves) {
  SessionBench bench({.role = wire::ROLE_OBSERVER});
  bench.join(minimal_joined(wire::ROLE_OBSERVER));
  EXPECT_FALSE(bench.scene_may_display());
  ClientUpdate update;
  update.input_tick = Tick{1};
  update.handle_valid = true;
  update.buttons = kButtonGrab;
  bench.mailboxes.outbox.publish(update);
  bench.session.poll(bench.now);
  ASSERT_EQ(bench.transport.datagrams.size(), 1U);
  ClientUpdate sent;
  ASSERT_EQ(parse_client_update(payload_of(bench.transport.datagrams[0]), sent), DropReason::kNone);
  EXPECT_FALSE(sent.handle_valid);
  EXPECT_EQ(sent.buttons, 0U);
}

TEST(ClientSession, AcknowledgesTheNewestUpdateAndHowLongItHadIt) {
  SessionBench bench;
  bench.join();
  bench.send_update();
  const LocalTime received = bench.now;
  ServerUpdate known;
  ASSERT_TRUE(bench.mailboxes.inbox.poll());
  known = bench.mailboxes.inbox.front().update;
  EXPECT_EQ(bench.mailboxes.inbox.front().received, received);
  bench.now += std::chrono::milliseconds(3);
  ClientUpdate update;
  update.input_tick = Tick{9};
  bench.mailboxes.outbox.publish(update);
  bench.session.poll(bench.now);
  ClientUpdate sent;
  ASSERT_EQ(parse_client_update(payload_of(bench.transport.datagrams.back()), sent), DropReason::kNone);
  EXPECT_EQ(sent.acknowledged_step, known.step);
  EXPECT_EQ(sent.acknowledged_sent, known.sent);
  EXPECT_EQ(sent.acknowledged_held, Duration(std::chrono::milliseconds(3)));
  EXPECT_EQ(sent.sent, bench.now);
}

TEST(ClientSession, StaysAudibleWithoutAHapticThread) {
  SessionBench bench;
  bench.join();
  for (int i = 0; i < 1000; ++i) {
    bench.send_update();
    bench.wait(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(bench.transport.datagrams.size(), 20U) << "one every 50 ms";
  ClientUpdate sent;
  ASSERT_EQ(parse_client_update(payload_of(bench.transport.datagrams.back()), sent), DropReason::kNone);
  EXPECT_FALSE(sent.handle_valid);
}

ClientUpdate newest_sent(const SessionBench& bench) {
  ClientUpdate sent;
  EXPECT_EQ(parse_client_update(payload_of(bench.transport.datagrams.back()), sent), DropReason::kNone);
  return sent;
}

ClientUpdate grabbing_update() {
  ClientUpdate update;
  update.input_tick = Tick{9};
  update.handle_valid = true;
  update.buttons = kButtonGrab;
  update.energy_to_hand_j = 3;
  update.energy_from_hand_j = 4;
  return update;
}

TEST(ClientSession, AStallOfTheHapticThreadNeitherLetsGoNorTakesEnergyBackAndADeadOneLetsGo) {
  SessionBench bench;
  bench.join();
  bench.mailboxes.outbox.publish(grabbing_update());
  bench.session.poll(bench.now);
  for (int stall_ms = 50; stall_ms <= 500; stall_ms += 50) {
    bench.wait(std::chrono::milliseconds(50));
    const ClientUpdate sent = newest_sent(bench);
    EXPECT_FALSE(sent.handle_valid) << stall_ms;
    EXPECT_EQ(sent.input_tick, Tick{9});
    EXPECT_EQ(sent.buttons, stall_ms <= 250 ? kButtonGrab : 0U) << stall_ms;
    EXPECT_EQ(sent.energy_to_hand_j, 3) << stall_ms;
    EXPECT_EQ(sent.energy_from_hand_j, 4) << stall_ms;
  }
  EXPECT_EQ(bench.transport.datagrams.size(), 11U);
}

TEST(ClientSession, KeepAliveSaysNothingOfAnOlderConnection) {
  SessionBench bench;
  bench.join();
  bench.mailboxes.outbox.publish(grabbing_update());
  bench.session.poll(bench.now);
  bench.session.on_disconnected(bench.now, "gone");
  while (bench.state() != "connecting") bench.wait(std::chrono::milliseconds(1));
  bench.mailboxes.outbox.publish(grabbing_update());  // written before the haptic thread knows the new scene
  bench.join();
  const std::size_t before = bench.transport.datagrams.size();
  bench.wait(std::chrono::milliseconds(50));
  ASSERT_EQ(bench.transport.datagrams.size(), before + 1);
  const ClientUpdate sent = newest_sent(bench);
  EXPECT_EQ(sent.buttons, 0U);
  EXPECT_EQ(sent.energy_to_hand_j, 0);
  EXPECT_EQ(sent.input_tick, Tick{});
}

TEST(ClientSession, DropsEachBadDatagramForItsOwnReasonAndKeepsTheNewestState) {
  SessionBench bench;
  bench.join();
  const Bytes first = bench.datagram_of(bench.next_update());
  const Bytes second = bench.datagram_of(bench.next_update());
  bench.session.on_datagram(second, bench.now);
  bench.session.on_datagram(second, bench.now);
  bench.session.on_datagram(first, bench.now);
  Bytes damaged = bench.datagram_of(bench.next_update());
  damaged.resize(damaged.size() - 2);
  bench.session.on_datagram(damaged, bench.now);
  Bytes of_another = bench.datagram_of(bench.next_update());
  of_another[5] ^= std::byte{1};
  bench.session.on_datagram(of_another, bench.now);
  const DropCounters& drops = bench.session.counters().received_drops;
  EXPECT_EQ(drops.of(DropReason::kDuplicate), 1U);
  EXPECT_EQ(drops.of(DropReason::kLate), 1U);
  EXPECT_EQ(drops.of(DropReason::kMalformed), 1U);
  EXPECT_EQ(drops.of(DropReason::kUnknownConnection), 1U);
  ASSERT_TRUE(bench.mailboxes.inbox.poll());
  EXPECT_EQ(bench.mailboxes.inbox.front().update.step, Step{2});
  EXPECT_FALSE(bench.mailboxes.inbox.poll());
}

TEST(ClientSession, SkipsStateOverTcpWhileControlBytesWait) {
  SessionBench bench({.state_transport = StateTransport::kTcp});
  bench.join();
  const auto publish = [&bench](std::uint64_t tick) {
    ClientUpdate update;
    update.input_tick = Tick{tick};
    bench.mailboxes.outbox.publish(update);
    bench.session.poll(bench.now);
  };
  publish(1);
  bench.transport.queued = 10;
  publish(2);
  bench.transport.queued = 0;
  publish(3);
  EXPECT_EQ(described(bench.transport.messages), "state_datagram, state_datagram");
  EXPECT_TRUE(bench.transport.datagrams.empty());
  EXPECT_EQ(bench.session.counters().sent_drops.of(DropReason::kOverwritten), 1U);
}

TEST(ClientSession, BacksOffByDoublingUpToItsLimitAndStartsOverAfterAJoin) {
  SessionBench bench;
  bench.join();
  bench.session.on_disconnected(bench.now, "cut");
  for (const int expected_ms : {250, 500, 1000, 2000, 2000}) {
    const LocalTime lost = bench.now;
    while (bench.state() == "waiting") bench.wait(std::chrono::milliseconds(1));
    EXPECT_EQ(bench.now - lost, Duration(std::chrono::milliseconds(expected_ms)));
    bench.session.on_disconnected(bench.now, "connection refused");
  }
  while (bench.state() == "waiting") bench.wait(std::chrono::milliseconds(1));
  bench.join();
  bench.session.on_disconnected(bench.now, "cut");
  bench.wait(std::chrono::milliseconds(250));
  EXPECT_EQ(bench.state(), "connecting");
}

TEST(ClientSession, SaysThatUdpMayBeBlockedWhenAJoinIsFollowedBySilence) {
  SessionBench bench;
  bench.join();
  bench.wait(std::chrono::milliseconds(1500));
  EXPECT_EQ(bench.state(), "waiting");
  EXPECT_THAT(bench.session.status().why, HasSubstr("--transport tcp"));
  SessionBench heard;
  heard.join();
  heard.send_update();
  heard.wait(std::chrono::milliseconds(1500));
  EXPECT_THAT(heard.session.status().why, HasSubstr("nothing came from the server for 1500 ms"));
}

TEST(ClientSession, TextFromTheWireCannotWriteEscapeSequences) {
  SessionBench bench;
  bench.session.on_connected(bench.now);
  bench.say_error(wire::ERROR_UNKNOWN_ROOM, "no\x1b[2J\nroom" + std::string(5000, 'x'));
  EXPECT_EQ(bench.session.status().why.find('\x1b'), std::string::npos);
  EXPECT_EQ(bench.session.status().why.find('\n'), std::string::npos);
  EXPECT_LT(bench.session.status().why.size(), 500U);
}

TEST(ClientSession, AParameterFromTheServerIsBoundedBeforeItReachesTheHand) {
  SessionBench bench;
  bench.join();
  bench.mailboxes.scene.poll();
  wire::ServerControl message;
  message.mutable_parameter_set()->set_name("coupling.stiffness_n_per_m");
  message.mutable_parameter_set()->set_value(123);
  bench.say(message);
  ASSERT_TRUE(bench.mailboxes.scene.poll());
  EXPECT_EQ(bench.mailboxes.scene.front().coupling.stiffness_n_per_m, 123);
  EXPECT_EQ(bench.mailboxes.scene.front().generation, 1U) << "a parameter restarts no ramp";
  message.mutable_parameter_set()->set_value(1e12);
  bench.say(message);
  EXPECT_FALSE(bench.mailboxes.scene.poll());
}

wire::Joined joined_with_asset(const std::string& bytes) {
  wire::Joined joined = minimal_joined();
  const Sha256 hash = sha256_of(std::as_bytes(std::span(bytes)));
  wire::AssetInfo& info = *joined.add_assets();
  info.set_sha256(hash.data(), hash.size());
  info.set_size_bytes(bytes.size());
  info.set_name("thing.obj");
  return joined;
}

/// Answers every asset request from `bytes`; returns how many there were.
int serve_assets(SessionBench& bench, const std::string& bytes) {
  int served = 0;
  while (!bench.transport.messages.empty()) {
    const auto requests = std::exchange(bench.transport.messages, {});
    for (const wire::ClientControl& request : requests) {
      wire::ServerControl answer;
      answer.set_request(request.request());
      wire::AssetChunk& chunk = *answer.mutable_asset_chunk();
      chunk.set_sha256(request.get_asset().sha256());
      chunk.set_offset(request.get_asset().offset());
      chunk.set_total_bytes(bytes.size());
      chunk.set_data(bytes.substr(request.get_asset().offset(), kAssetChunkBytes));
      bench.say(answer);
      ++served;
    }
  }
  return served;
}

TEST(ClientSession, FetchesAnAssetOnceAndKeepsItOnlyWhenItsHashIsRight) {
  const std::string bytes(150'000, 'v');
  const wire::Joined joined = joined_with_asset(bytes);
  SessionBench bench;
  bench.session.on_connected(bench.now);
  bench.say_welcome();
  bench.transport.messages.clear();
  bench.say_joined(joined);
  EXPECT_EQ(serve_assets(bench, bytes), 3);
  ASSERT_EQ(bench.session.assets().size(), 1U);
  EXPECT_EQ(bench.session.assets().begin()->second->size(), bytes.size());
  bench.session.on_disconnected(bench.now, "cut");
  bench.wait(std::chrono::milliseconds(250));
  bench.session.on_connected(bench.now);
  bench.say_welcome();
  bench.transport.messages.clear();
  bench.say_joined(joined);
  EXPECT_EQ(serve_assets(bench, bytes), 0) << "it is here already";

  SessionBench cheated;
  cheated.session.on_connected(cheated.now);
  cheated.say_welcome();
  cheated.transport.messages.clear();
  cheated.say_joined(joined);
  serve_assets(cheated, std::string(150'000, 'w'));
  EXPECT_TRUE(cheated.session.assets().empty());
  EXPECT_EQ(cheated.state(), "active") << "a bad file is no reason to let go of the hand";
}

TEST(AssetFetcher, PlansNoMoreThanItsLimitHoweverManyAreOffered) {
  AssetFetcher fetcher(1000);
  wire::Joined joined;
  for (const std::uint64_t size : {600ULL, 600ULL, 400ULL, ~0ULL}) {
    wire::AssetInfo& info = *joined.add_assets();
    info.set_sha256(std::string(31, 'h') + static_cast<char>('a' + joined.assets_size()));
    info.set_size_bytes(size);
  }
  EXPECT_EQ(fetcher.begin(joined.assets()).size(), 2U);
}

TEST(SessionsBackToBack, TwoHandsShareARoomAndAnObserverSeesThem) {
  BackToBack net(two_hands_scene(), std::chrono::milliseconds(10));
  WiredClient& ada = net.add_client({.user_name = "ada"}, std::chrono::hours(5));
  WiredClient& ben = net.add_client({.user_name = "ben"}, -std::chrono::seconds(3));
  WiredClient& eve = net.add_client({.user_name = "eve", .role = wire::ROLE_OBSERVER});
  net.run(100);
  ASSERT_EQ(ada.session.status().state, SessionState::kActive);
  ASSERT_EQ(ben.session.status().state, SessionState::kActive);
  ASSERT_EQ(eve.session.status().state, SessionState::kActive);
  for (int i = 0; i < 500; ++i) {
    ada.publish_handle({Vec3(-0.02, 0.01, 0), Quat::Identity()});
    ben.publish_handle({Vec3(0.02, -0.01, 0), Quat::Identity()});
    net.run(1);
  }
  ASSERT_NE(ada.newest(), nullptr);
  ASSERT_NE(eve.newest(), nullptr);
  EXPECT_NEAR(ada.newest()->tool.X.p.y(), 0.01, 1e-3);
  EXPECT_NEAR(ben.newest()->tool.X.p.y(), -0.01, 1e-3);
  EXPECT_EQ(ada.newest()->users.size(), 1U);
  EXPECT_EQ(eve.newest()->users.size(), 2U);
  EXPECT_NEAR(to_seconds(ada.session.clock_sync().round_trip()), 0.020, 1e-9);
  // The link is symmetric, so the estimate of the offset is exact.
  EXPECT_EQ(ada.session.clock_sync().offset(ada.own_time()), Duration(-std::chrono::hours(5)));
  EXPECT_EQ(ben.session.clock_sync().offset(ben.own_time()), Duration(std::chrono::seconds(3)));
  ada.session.grab(BodyId{1});
  net.run(30);
  EXPECT_EQ(ada.newest()->held_body, BodyId{1});
  EXPECT_EQ(eve.newest()->bodies.at(0).held_by.value, ada.session.joined()->user());
}

TEST(SessionsBackToBack, ASessionOverTcpIsTheSameSession) {
  BackToBack net(two_hands_scene(), std::chrono::milliseconds(10));
  net.delivers_datagrams = false;
  WiredClient& ada = net.add_client({.user_name = "ada", .state_transport = StateTransport::kTcp});
  for (int i = 0; i < 3000; ++i) {
    ada.publish_handle({Vec3(-0.02, 0.01, 0), Quat::Identity()});
    net.run(1);
  }
  EXPECT_EQ(ada.session.status().state, SessionState::kActive);
  ASSERT_NE(ada.newest(), nullptr);
  EXPECT_NEAR(ada.newest()->tool.X.p.y(), 0.01, 1e-3);
  EXPECT_GT(ada.session.counters().datagrams_received, 2900U);
}

TEST(SessionsBackToBack, AKilledServerThatComesBackIsJoinedAgain) {
  BackToBack net(two_hands_scene());
  WiredClient& ada = net.add_client({.user_name = "ada"});
  net.run(50);
  ASSERT_EQ(ada.session.status().state, SessionState::kActive);
  net.kill_server();
  net.run(1000);
  EXPECT_EQ(ada.session.status().state, SessionState::kWaiting);
  EXPECT_FALSE(ada.session.status().why.empty());
  net.start_server();
  net.run(2500);
  EXPECT_EQ(ada.session.status().state, SessionState::kActive);
  EXPECT_EQ(ada.session.status().why, "");
  EXPECT_EQ(ada.session.counters().reconnects, 1U);
  const auto before = ada.session.counters().datagrams_received;
  net.run(100);
  EXPECT_GE(ada.session.counters().datagrams_received, before + 99) << "and its state flows again";
}

TEST(SessionsBackToBack, SilenceOnTheStatePathIsNoticedByBothEnds) {
  BackToBack net(two_hands_scene());
  WiredClient& ada = net.add_client({.user_name = "ada", .may_reconnect = false});
  net.run(50);
  net.delivers_datagrams = false;
  net.run(1600);
  EXPECT_EQ(ada.session.status().state, SessionState::kEnded);
  EXPECT_FALSE(ada.session.status().is_setup_error);
  EXPECT_EQ(net.hub->user_count(), 0U);
}

TEST(SessionsBackToBack, DamagedBytesNeverCrashAndNeverLastLongerThanTheDamage) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    BackToBack net(two_hands_scene());
    WiredClient& ada = net.add_client({.user_name = "ada"});
    WiredClient& ben = net.add_client({.user_name = "ben", .state_transport = StateTransport::kTcp});
    net.run(50);
    ASSERT_EQ(ben.session.status().state, SessionState::kActive);
    net.damage = [&random](Bytes& bytes) {
      if (bytes.empty() || random.uniform() > 0.1) return;
      bytes[random.next_u32() % bytes.size()] = static_cast<std::byte>(random.next_u32());
      if (random.uniform() < 0.1) bytes.resize(random.next_u32() % (bytes.size() + 1));
    };
    for (int i = 0; i < 3000; ++i) {
      ada.publish_handle({Vec3(-0.02, 0, 0), Quat::Identity()}, i % 100 < 50 ? 0U : 1U);
      ben.publish_handle({Vec3(0.02, 0, 0), Quat::Identity()});
      net.run(1);
    }
    net.damage = {};
    net.run(10'000);
    for (WiredClient* client : {&ada, &ben}) {
      // Damage can spell a refusal, but nothing worse: a session is active, or it says why not.
      const SessionStatus& status = client->session.status();
      EXPECT_TRUE(status.state == SessionState::kActive || status.is_setup_error) << status.why;
    }
  }
}

}  // namespace
}  // namespace tandem
