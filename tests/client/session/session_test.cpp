#include "client/session/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <span>

#include "common/base/random.hpp"
#include "tests/support/back_to_back.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

using testing::HasSubstr;

TEST(ClientSession, PublishesTheSceneOfEachJoinAsANewGeneration) {
  test::SessionBench bench;
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
         for (std::size_t i = 0; i <= proto::kMaxBodies; ++i) j.mutable_scene()->add_bodies();
       }},
  };
  for (const auto& [field, change] : changes) {
    SCOPED_TRACE(field);
    wire::Joined joined = test::minimal_joined();
    change(joined);
    test::SessionBench bench;
    bench.join(joined);
    EXPECT_EQ(bench.state(), "ended");
    EXPECT_TRUE(bench.session.status().is_setup_error);
    EXPECT_THAT(bench.session.status().why, HasSubstr(field));
    EXPECT_FALSE(bench.mailboxes.scene.poll());
  }
  wire::Joined not_a_number = test::minimal_joined();
  not_a_number.mutable_scene()->mutable_coupling()->set_force_limit_n(nan);
  test::SessionBench bench;
  bench.join(not_a_number);
  EXPECT_EQ(bench.state(), "ended");
}

TEST(ClientSession, AnObserverSendsThatItIsThereAndNothingThatMoves) {
  test::SessionBench bench({.role = wire::ROLE_OBSERVER});
  bench.join(test::minimal_joined(wire::ROLE_OBSERVER));
  EXPECT_FALSE(bench.scene_may_display());
  proto::ClientUpdate update;
  update.input_tick = Tick{1};
  update.handle_valid = true;
  update.buttons = kButtonGrab;
  bench.mailboxes.outbox.publish(update);
  bench.session.poll(bench.now);
  ASSERT_EQ(bench.transport.datagrams.size(), 1U);
  proto::ClientUpdate sent;
  ASSERT_EQ(proto::parse_client_update(proto::payload_of(bench.transport.datagrams[0]), sent),
            proto::DropReason::kNone);
  EXPECT_FALSE(sent.handle_valid);
  EXPECT_EQ(sent.buttons, 0U);
}

TEST(ClientSession, AcknowledgesTheNewestUpdateAndHowLongItHadIt) {
  test::SessionBench bench;
  bench.join();
  bench.send_update();
  const LocalTime received = bench.now;
  proto::ServerUpdate known;
  ASSERT_TRUE(bench.mailboxes.inbox.poll());
  known = bench.mailboxes.inbox.front().update;
  EXPECT_EQ(bench.mailboxes.inbox.front().received, received);
  bench.now += std::chrono::milliseconds(3);
  proto::ClientUpdate update;
  update.input_tick = Tick{9};
  bench.mailboxes.outbox.publish(update);
  bench.session.poll(bench.now);
  proto::ClientUpdate sent;
  ASSERT_EQ(proto::parse_client_update(proto::payload_of(bench.transport.datagrams.back()), sent),
            proto::DropReason::kNone);
  EXPECT_EQ(sent.acknowledged_step, known.step);
  EXPECT_EQ(sent.acknowledged_sent, known.sent);
  EXPECT_EQ(sent.acknowledged_held, Duration(std::chrono::milliseconds(3)));
  EXPECT_EQ(sent.sent, bench.now);
}

TEST(ClientSession, StaysAudibleWithoutAHapticThread) {
  test::SessionBench bench;
  bench.join();
  for (int i = 0; i < 1000; ++i) {
    bench.send_update();
    bench.wait(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(bench.transport.datagrams.size(), 20U) << "one every 50 ms";
  proto::ClientUpdate sent;
  ASSERT_EQ(proto::parse_client_update(proto::payload_of(bench.transport.datagrams.back()), sent),
            proto::DropReason::kNone);
  EXPECT_FALSE(sent.handle_valid);
}

proto::ClientUpdate newest_sent(const test::SessionBench& bench) {
  proto::ClientUpdate sent;
  EXPECT_EQ(proto::parse_client_update(proto::payload_of(bench.transport.datagrams.back()), sent),
            proto::DropReason::kNone);
  return sent;
}

proto::ClientUpdate grabbing_update() {
  proto::ClientUpdate update;
  update.input_tick = Tick{9};
  update.handle_valid = true;
  update.buttons = kButtonGrab;
  update.energy_to_hand_j = 3;
  update.energy_from_hand_j = 4;
  return update;
}

TEST(ClientSession, AStallOfTheHapticThreadNeitherLetsGoNorTakesEnergyBackAndADeadOneLetsGo) {
  test::SessionBench bench;
  bench.join();
  bench.mailboxes.outbox.publish(grabbing_update());
  bench.session.poll(bench.now);
  for (int stall_ms = 50; stall_ms <= 500; stall_ms += 50) {
    bench.wait(std::chrono::milliseconds(50));
    const proto::ClientUpdate sent = newest_sent(bench);
    EXPECT_FALSE(sent.handle_valid) << stall_ms;
    EXPECT_EQ(sent.input_tick, Tick{9});
    EXPECT_EQ(sent.buttons, stall_ms <= 250 ? kButtonGrab : 0U) << stall_ms;
    EXPECT_EQ(sent.energy_to_hand_j, 3) << stall_ms;
    EXPECT_EQ(sent.energy_from_hand_j, 4) << stall_ms;
  }
  EXPECT_EQ(bench.transport.datagrams.size(), 11U);
}

TEST(ClientSession, KeepAliveSaysNothingOfAnOlderConnection) {
  test::SessionBench bench;
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
  const proto::ClientUpdate sent = newest_sent(bench);
  EXPECT_EQ(sent.buttons, 0U);
  EXPECT_EQ(sent.energy_to_hand_j, 0);
  EXPECT_EQ(sent.input_tick, Tick{});
}

TEST(ClientSession, DropsEachBadDatagramForItsOwnReasonAndKeepsTheNewestState) {
  test::SessionBench bench;
  bench.join();
  const proto::Bytes first = bench.datagram_of(bench.next_update());
  const proto::Bytes second = bench.datagram_of(bench.next_update());
  bench.session.on_datagram(second, bench.now);
  bench.session.on_datagram(second, bench.now);
  bench.session.on_datagram(first, bench.now);
  proto::Bytes damaged = bench.datagram_of(bench.next_update());
  damaged.resize(damaged.size() - 2);
  bench.session.on_datagram(damaged, bench.now);
  proto::Bytes of_another = bench.datagram_of(bench.next_update());
  of_another[5] ^= std::byte{1};
  bench.session.on_datagram(of_another, bench.now);
  const proto::DropCounters& drops = bench.session.counters().received_drops;
  EXPECT_EQ(drops.of(proto::DropReason::kDuplicate), 1U);
  EXPECT_EQ(drops.of(proto::DropReason::kLate), 1U);
  EXPECT_EQ(drops.of(proto::DropReason::kMalformed), 1U);
  EXPECT_EQ(drops.of(proto::DropReason::kUnknownConnection), 1U);
  ASSERT_TRUE(bench.mailboxes.inbox.poll());
  EXPECT_EQ(bench.mailboxes.inbox.front().update.step, Step{2});
  EXPECT_FALSE(bench.mailboxes.inbox.poll());
}

TEST(ClientSession, SkipsStateOverTcpWhileControlBytesWait) {
  test::SessionBench bench({.state_transport = StateTransport::kTcp});
  bench.join();
  const auto publish = [&bench](std::uint64_t tick) {
    proto::ClientUpdate update;
    update.input_tick = Tick{tick};
    bench.mailboxes.outbox.publish(update);
    bench.session.poll(bench.now);
  };
  publish(1);
  bench.transport.queued = 10;
  publish(2);
  bench.transport.queued = 0;
  publish(3);
  EXPECT_EQ(test::described(bench.transport.messages), "state_datagram, state_datagram");
  EXPECT_TRUE(bench.transport.datagrams.empty());
  EXPECT_EQ(bench.session.counters().sent_drops.of(proto::DropReason::kOverwritten), 1U);
}

TEST(ClientSession, BacksOffByDoublingUpToItsLimitAndStartsOverAfterAJoin) {
  test::SessionBench bench;
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
  test::SessionBench bench;
  bench.join();
  bench.wait(std::chrono::milliseconds(1500));
  EXPECT_EQ(bench.state(), "waiting");
  EXPECT_THAT(bench.session.status().why, HasSubstr("--transport tcp"));
  test::SessionBench heard;
  heard.join();
  heard.send_update();
  heard.wait(std::chrono::milliseconds(1500));
  EXPECT_THAT(heard.session.status().why, HasSubstr("nothing came from the server for 1500 ms"));
}

TEST(ClientSession, TextFromTheWireCannotWriteEscapeSequences) {
  test::SessionBench bench;
  bench.session.on_connected(bench.now);
  bench.say_error(wire::ERROR_UNKNOWN_ROOM, "no\x1b[2J\nroom" + std::string(5000, 'x'));
  EXPECT_EQ(bench.session.status().why.find('\x1b'), std::string::npos);
  EXPECT_EQ(bench.session.status().why.find('\n'), std::string::npos);
  EXPECT_LT(bench.session.status().why.size(), 500U);
}

TEST(ClientSession, AParameterFromTheServerIsBoundedBeforeItReachesTheHand) {
  test::SessionBench bench;
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
  wire::Joined joined = test::minimal_joined();
  const proto::Sha256 hash = proto::sha256_of(std::as_bytes(std::span(bytes)));
  wire::AssetInfo& info = *joined.add_assets();
  info.set_sha256(hash.data(), hash.size());
  info.set_size_bytes(bytes.size());
  info.set_name("thing.obj");
  return joined;
}

/// Answers every asset request from `bytes`; returns how many there were.
int serve_assets(test::SessionBench& bench, const std::string& bytes) {
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
      chunk.set_data(bytes.substr(request.get_asset().offset(), proto::kAssetChunkBytes));
      bench.say(answer);
      ++served;
    }
  }
  return served;
}

TEST(ClientSession, FetchesAnAssetOnceAndKeepsItOnlyWhenItsHashIsRight) {
  const std::string bytes(150'000, 'v');
  const wire::Joined joined = joined_with_asset(bytes);
  test::SessionBench bench;
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

  test::SessionBench cheated;
  cheated.session.on_connected(cheated.now);
  cheated.say_welcome();
  cheated.transport.messages.clear();
  cheated.say_joined(joined);
  serve_assets(cheated, std::string(150'000, 'w'));
  EXPECT_TRUE(cheated.session.assets().empty());
  EXPECT_EQ(cheated.state(), "active") << "a bad file is no reason to let go of the hand";
}

/// Joins with a scene that has one asset; the store and the session are asked before the server is.
struct StoreBench {
  explicit StoreBench(std::shared_ptr<AssetStore> store, const wire::Joined& joined)
      : bench([&store] {
          SessionSettings settings;
          settings.asset_store = std::move(store);
          return settings;
        }()) {
    bench.session.on_assets = [this] { ++announced; };
    bench.session.on_connected(bench.now);
    bench.say_welcome();
    bench.transport.messages.clear();
    bench.say_joined(joined);
  }

  test::SessionBench bench;
  int announced = 0;
};

TEST(ClientSession, AsksTheStoreBeforeTheServerAndAnnouncesAllAssetsOnceAJoin) {
  const std::string bytes(150'000, 'v');
  const wire::Joined joined = joined_with_asset(bytes);
  const auto store = std::make_shared<MemoryAssetStore>();
  StoreBench first(store, joined);
  EXPECT_EQ(first.announced, 0) << "it is not here yet";
  EXPECT_EQ(serve_assets(first.bench, bytes), 3);
  EXPECT_EQ(first.announced, 1);
  StoreBench second(store, joined);
  EXPECT_EQ(serve_assets(second.bench, bytes), 0);
  EXPECT_EQ(second.announced, 1);
  EXPECT_EQ(second.bench.session.assets().size(), 1U);
  StoreBench without(nullptr, test::minimal_joined());
  EXPECT_EQ(without.announced, 1) << "a scene without assets has them all";
  StoreBench cheated(nullptr, joined);
  serve_assets(cheated.bench, std::string(150'000, 'w'));
  EXPECT_EQ(cheated.announced, 0);
}

class DiskStore : public ::testing::Test {
 protected:
  DiskStore() : directory_(std::filesystem::temp_directory_path() / ("tandem_store_" + std::to_string(getpid()))) {
    std::filesystem::remove_all(directory_);
  }
  ~DiskStore() override { std::filesystem::remove_all(directory_); }

  static std::shared_ptr<const proto::Bytes> bytes_of(char letter, std::size_t count) {
    return std::make_shared<const proto::Bytes>(count, static_cast<std::byte>(letter));
  }
  std::filesystem::path only_file() const { return std::filesystem::directory_iterator(directory_)->path(); }

  std::filesystem::path directory_;
};

TEST_F(DiskStore, GivesBackWhatAnotherProgramKept) {
  const auto bytes = bytes_of('a', 1000);
  const proto::Sha256 hash = proto::sha256_of(*bytes);
  EXPECT_EQ(DiskAssetStore(directory_).find(hash), nullptr);
  DiskAssetStore(directory_).keep(hash, bytes);
  const auto found = DiskAssetStore(directory_).find(hash);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(*found, *bytes);
}

TEST_F(DiskStore, NeverGivesBytesOfAnotherHashAndRemovesThem) {
  const auto bytes = bytes_of('a', 1000);
  const proto::Sha256 hash = proto::sha256_of(*bytes);
  DiskAssetStore store(directory_);
  store.keep(hash, bytes);
  std::fstream(only_file(), std::ios::binary | std::ios::in | std::ios::out).seekp(500).put('b');
  EXPECT_EQ(store.find(hash), nullptr);
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

TEST_F(DiskStore, StaysWithinItsLimitByWhatWasNotUsedForLongest) {
  DiskAssetStore store(directory_, 2500);
  std::vector<proto::Sha256> hashes;
  for (const char letter : {'a', 'b', 'c'}) {
    const auto bytes = bytes_of(letter, 1000);
    hashes.push_back(proto::sha256_of(*bytes));
    store.keep(hashes.back(), bytes);
    // The clock of a file system may be coarse.
    const auto hours = std::chrono::hours(letter == 'a' ? 1 : 2);
    for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
      if (letter == 'c') continue;
      std::filesystem::last_write_time(entry, std::filesystem::file_time_type::clock::now() - hours);
    }
    if (letter != 'b') continue;
    EXPECT_NE(store.find(hashes[0]), nullptr) << "used now, so b is the oldest";
  }
  EXPECT_NE(store.find(hashes[0]), nullptr);
  EXPECT_EQ(store.find(hashes[1]), nullptr);
  EXPECT_NE(store.find(hashes[2]), nullptr);
  const auto huge = bytes_of('d', 3000);
  store.keep(proto::sha256_of(*huge), huge);
  EXPECT_EQ(store.find(proto::sha256_of(*huge)), nullptr);
  EXPECT_NE(store.find(hashes[0]), nullptr) << "what cannot be kept must push nothing out";
}

/// Datagrams sent while the haptic thread publishes `handle_at(ms)` for a second, at 1 kHz.
std::size_t datagrams_in_a_second(
    double deadband, const std::function<RigidState(int)>& handle_at,
    const std::function<std::uint32_t(int)>& buttons_at = [](int) { return 0U; }) {
  SessionSettings settings;
  settings.deadband = deadband;
  wire::Joined joined = test::minimal_joined();
  joined.mutable_scene()->mutable_coupling()->set_stiffness_n_per_m(300);
  test::SessionBench bench(settings);
  bench.join(joined);
  bench.send_update();
  for (int ms = 0; ms < 1000; ++ms) {
    proto::ClientUpdate update;
    update.input_tick = Tick{static_cast<std::uint64_t>(ms) + 1};
    update.handle = handle_at(ms);
    update.handle_valid = true;
    update.buttons = buttons_at(ms);
    bench.mailboxes.outbox.publish(update);
    bench.wait(std::chrono::milliseconds(1));
    if (ms % 10 == 0) bench.send_update();
  }
  EXPECT_EQ(bench.session.counters().updates_suppressed + bench.session.counters().datagrams_sent, 1000U);
  return bench.transport.datagrams.size();
}

TEST(ClientSession, ADeadbandThinsRestAndSteadyMotionToTheFloorRate) {
  const auto resting = [](int) { return RigidState{}; };
  const auto steady = [](int ms) {
    RigidState state;
    state.V.v = Vec3(0.2, 0, 0);
    state.X.p = state.V.v * 1e-3 * ms;
    return state;
  };
  EXPECT_EQ(datagrams_in_a_second(0, resting), 1000U);
  EXPECT_EQ(datagrams_in_a_second(0.1, resting), 100U);
  EXPECT_EQ(datagrams_in_a_second(0.1, steady), 100U) << "the server goes on as it last moved";
}

TEST(ClientSession, ADeadbandLetsThroughAtOnceWhatAHandWouldNotice) {
  const auto resting = [](int) { return RigidState{}; };
  const auto jerky = [](int ms) {
    RigidState state;
    state.X.p.x() = 0.001 * (ms % 2);  // 0.3 N of 300 N/m
    return state;
  };
  EXPECT_EQ(datagrams_in_a_second(0.1, jerky), 1000U);
  // Pressed and let go, each time between two of the floor's: two more.
  const auto pressed = [](int ms) { return ms >= 505 && ms < 512 ? std::uint32_t{kButtonGrab} : 0U; };
  const std::size_t sent = datagrams_in_a_second(0.1, resting, pressed);
  EXPECT_GT(sent, 100U);
  EXPECT_LE(sent, 102U);
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
  test::BackToBack net(test::two_hands_scene(), std::chrono::milliseconds(10));
  test::WiredClient& ada = net.add_client({.user_name = "ada"}, std::chrono::hours(5));
  test::WiredClient& ben = net.add_client({.user_name = "ben"}, -std::chrono::seconds(3));
  test::WiredClient& eve = net.add_client({.user_name = "eve", .role = wire::ROLE_OBSERVER});
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

/// Down to a floor in 1 s, 15 mm into it for 2 s with a tremor of 0.1 mm at 9 Hz, and up again.
RigidState pressing_hand(double t) {
  constexpr double kWay_m = 0.05, kTremor_m = 1e-4, kTremorRate = 2 * std::numbers::pi * 9;
  const double u = t < 1 ? t : t < 3 ? 1 : std::max(0.0, 4 - t);
  const double direction = t < 1 ? 1 : t < 3 ? 0 : -1;
  RigidState hand;
  // Minimum jerk, as hands move.
  hand.X.p.z() = 0.04 - kWay_m * u * u * u * (10 - 15 * u + 6 * u * u) + kTremor_m * std::sin(kTremorRate * t);
  hand.V.v.z() =
      -kWay_m * direction * 30 * u * u * (1 - u) * (1 - u) + kTremor_m * kTremorRate * std::cos(kTremorRate * t);
  return hand;
}

struct Pressed {
  double sent_up = 0;  ///< share of what would be without a deadband
  double sent_down = 0;
  double largest_n = 0;
};

Pressed press_on_a_floor(double deadband) {
  const std::string scene = R"({"name": "wall",
    "bodies": [{"name": "floor", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}],
                "placement": {"position_m": [0, 0, -0.05]}}],
    "tools": [{"name": "t", "placement": {"position_m": [0, 0, 0.04]}}],
    "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 3}})";
  test::BackToBack net(scene, std::chrono::milliseconds(10));
  test::WiredClient& ada = net.add_client({.user_name = "ada", .deadband = deadband});
  net.run(100);
  Pressed pressed;
  for (int ms = 0; ms < 4000; ++ms) {
    const RigidState hand = pressing_hand(1e-3 * ms);
    ada.publish_handle(hand.X, 0, hand.V);
    net.run(1);
    const proto::ServerUpdate* told = ada.newest();
    if (told == nullptr) continue;
    pressed.largest_n = std::max(pressed.largest_n, told->wrench_on_hand_W.f.norm());
  }
  const auto share = [](std::uint64_t sent, std::uint64_t held_back) {
    return static_cast<double>(sent) / static_cast<double>(sent + held_back);
  };
  const SessionCounters& up = ada.session.counters();
  const server::HubCounters& down = net.hub->counters();
  pressed.sent_up = share(up.datagrams_sent, up.updates_suppressed);
  pressed.sent_down = share(down.datagrams_sent, down.updates_suppressed);
  return pressed;
}

TEST(SessionsBackToBack, ADeadbandOfTenPercentSavesMostDatagramsOfPressingOnAFloorAndLittleIsFelt) {
  const Pressed all = press_on_a_floor(0);
  const Pressed thinned = press_on_a_floor(0.1);
  EXPECT_EQ(all.sent_up, 1);
  EXPECT_EQ(all.sent_down, 1);
  EXPECT_LE(thinned.sent_up, 0.15);
  EXPECT_LE(thinned.sent_down, 0.15);
  ASSERT_GT(all.largest_n, 2);
  EXPECT_NEAR(thinned.largest_n, all.largest_n, 0.1 * all.largest_n);
}

TEST(SessionsBackToBack, ASessionOverTcpIsTheSameSession) {
  test::BackToBack net(test::two_hands_scene(), std::chrono::milliseconds(10));
  net.delivers_datagrams = false;
  test::WiredClient& ada = net.add_client({.user_name = "ada", .state_transport = StateTransport::kTcp});
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
  test::BackToBack net(test::two_hands_scene());
  test::WiredClient& ada = net.add_client({.user_name = "ada"});
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
  test::BackToBack net(test::two_hands_scene());
  test::WiredClient& ada = net.add_client({.user_name = "ada", .may_reconnect = false});
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
    test::BackToBack net(test::two_hands_scene());
    test::WiredClient& ada = net.add_client({.user_name = "ada"});
    test::WiredClient& ben = net.add_client({.user_name = "ben", .state_transport = StateTransport::kTcp});
    net.run(50);
    ASSERT_EQ(ben.session.status().state, SessionState::kActive);
    net.damage = [&random](proto::Bytes& bytes) {
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
    for (test::WiredClient* client : {&ada, &ben}) {
      // Damage can spell a refusal, but nothing worse: a session is active, or it says why not.
      const SessionStatus& status = client->session.status();
      EXPECT_TRUE(status.state == SessionState::kActive || status.is_setup_error) << status.why;
    }
  }
}

}  // namespace
}  // namespace tandem::client
