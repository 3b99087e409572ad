// Tests the state stream of a session: updates from the haptic thread to the server, and updates from the server.
#include <gtest/gtest.h>

#include <functional>

#include "client/session/session.hpp"
#include "tests/support/session_bench.hpp"

namespace tandem::client {
namespace {

TEST(StateStream, AnObserverSendsUpdatesWithoutMotion) {
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

TEST(StateStream, AcknowledgesTheNewestUpdateAndHowLongItHadIt) {
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

TEST(StateStream, StaysAudibleWithoutAHapticThread) {
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

TEST(StateStream, AStallOfTheHapticThreadNeitherLetsGoNorTakesEnergyBackAndADeadOneLetsGo) {
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

TEST(StateStream, KeepAliveContainsNothingOfAnOlderConnection) {
  test::SessionBench bench;
  bench.join();
  bench.mailboxes.outbox.publish(grabbing_update());
  bench.session.poll(bench.now);
  bench.session.on_disconnected(bench.now, "gone");
  while (bench.state() != "connecting") bench.wait(std::chrono::milliseconds(1));
  bench.mailboxes.outbox.publish(grabbing_update());  // written before the haptic thread has adopted the new scene
  bench.join();
  const std::size_t before = bench.transport.datagrams.size();
  bench.wait(std::chrono::milliseconds(50));
  ASSERT_EQ(bench.transport.datagrams.size(), before + 1);
  const proto::ClientUpdate sent = newest_sent(bench);
  EXPECT_EQ(sent.buttons, 0U);
  EXPECT_EQ(sent.energy_to_hand_j, 0);
  EXPECT_EQ(sent.input_tick, Tick{});
}

TEST(StateStream, DropsEachBadDatagramForItsOwnReasonAndKeepsTheNewestState) {
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
  EXPECT_EQ(drops.count(proto::DropReason::kDuplicate), 1U);
  EXPECT_EQ(drops.count(proto::DropReason::kLate), 1U);
  EXPECT_EQ(drops.count(proto::DropReason::kMalformed), 1U);
  EXPECT_EQ(drops.count(proto::DropReason::kUnknownConnection), 1U);
  ASSERT_TRUE(bench.mailboxes.inbox.poll());
  EXPECT_EQ(bench.mailboxes.inbox.front().update.step, Step{2});
  EXPECT_FALSE(bench.mailboxes.inbox.poll());
}

TEST(StateStream, SkipsStateOverTcpWhileControlBytesWait) {
  test::SessionBench bench({.state_over_tcp = true});
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
  EXPECT_EQ(bench.session.counters().sent_drops.count(proto::DropReason::kOverwritten), 1U);
}

/// Returns the number of datagrams sent within one second. In each millisecond the haptic thread publishes the pose
/// `handle_at(ms)`.
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

TEST(StateStream, ADeadbandThinsRestAndSteadyMotionToTheFloorRate) {
  const auto resting = [](int) { return RigidState{}; };
  const auto steady = [](int ms) {
    RigidState state;
    state.V.v = Vec3(0.2, 0, 0);
    state.X.p = state.V.v * 1e-3 * ms;
    return state;
  };
  EXPECT_EQ(datagrams_in_a_second(0, resting), 1000U);
  EXPECT_EQ(datagrams_in_a_second(0.1, resting), 100U);
  EXPECT_EQ(datagrams_in_a_second(0.1, steady), 100U) << "the server extrapolates the last motion";
}

TEST(StateStream, ADeadbandPassesPerceptibleChangesAtOnce) {
  const auto resting = [](int) { return RigidState{}; };
  const auto jerky = [](int ms) {
    RigidState state;
    state.X.p.x() = 0.001 * (ms % 2);  // a step of 1 mm changes the force by 0.3 N at 300 N/m
    return state;
  };
  EXPECT_EQ(datagrams_in_a_second(0.1, jerky), 1000U);
  // At rest, 100 datagrams are sent in the second. A button is pressed and released between two of them. Each of these
  // two changes must cause one more datagram.
  const auto pressed = [](int ms) { return ms >= 505 && ms < 512 ? std::uint32_t{kButtonGrab} : 0U; };
  const std::size_t sent = datagrams_in_a_second(0.1, resting, pressed);
  EXPECT_GT(sent, 100U);
  EXPECT_LE(sent, 102U);
}

TEST(StateStream, ARepeatedStepIsIgnoredWhateverItsSequence) {
  test::SessionBench bench;
  bench.join();
  proto::ServerUpdate update = bench.next_update();
  update.stepped = ServerTime(std::chrono::seconds(60));
  bench.session.on_datagram(bench.datagram_of(update), bench.now);
  ASSERT_TRUE(bench.mailboxes.inbox.poll());
  for (int i = 0; i < 100; ++i) bench.session.on_datagram(bench.datagram_of(update), bench.now);
  EXPECT_FALSE(bench.mailboxes.inbox.poll()) << "frozen step under a rising sequence";
  proto::ServerUpdate older = bench.next_update();
  older.stepped = update.stepped - std::chrono::milliseconds(1);
  bench.session.on_datagram(bench.datagram_of(older), bench.now);
  EXPECT_FALSE(bench.mailboxes.inbox.poll()) << "time went back";
  older.stepped = update.stepped;
  bench.session.on_datagram(bench.datagram_of(older), bench.now);
  EXPECT_FALSE(bench.mailboxes.inbox.poll()) << "the time does not advance although the step does";
  older.stepped += std::chrono::milliseconds(1);
  bench.session.on_datagram(bench.datagram_of(older), bench.now);
  EXPECT_FALSE(bench.mailboxes.inbox.poll()) << "a step from after its datagram";
  bench.now += std::chrono::milliseconds(1);
  bench.session.on_datagram(bench.datagram_of(older), bench.now);
  EXPECT_TRUE(bench.mailboxes.inbox.poll());
}

}  // namespace
}  // namespace tandem::client
