// Tests the state stream of a user: which updates of the room are sent, and which client updates are accepted.
#include <gtest/gtest.h>

#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using test::message_of;

TEST(StateStream, ANewUserDoesNotReceiveTheStateOfTheSeatsFormerUser) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_MANIPULATOR, "state-tcp");
  bench.step();
  bench.send(ada, message_of([](auto& message) { message.mutable_leave(); }));
  test::BenchClient ben = bench.join("ben", wire::ROLE_MANIPULATOR, "state-tcp");
  ASSERT_EQ(ben.joined.tool(), ada.joined.tool());
  bench.drain(ben);
  // Ada has left, and ben has joined and got her tool. The room may still publish one update for ada, if it has not
  // read the join from its command ring yet. The test publishes such an update itself, because it cannot delay the
  // ring. Ben must not receive the update.
  RoomUpdate late;
  late.user[0] = UserId{ada.joined.user()};
  late.own[0].step = Step{77};
  bench.now += std::chrono::milliseconds(1);
  late.own[0].stepped = server_time_of_own_clock(bench.now);
  bench.rooms[0]->output().publish(late);
  bench.hub->poll(VirtualClock(bench.now));
  EXPECT_EQ(test::described(bench.drain(ben)), "");
  bench.step();
  EXPECT_EQ(test::described(bench.drain(ben)), "state_datagram");
}

TEST(StateStream, SendsEachPublishedStepOnceWithTheFourTimeStamps) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.step();
  EXPECT_TRUE(bench.drain_datagrams(ada).empty()) << "before its first datagram a user has no address";
  proto::ClientUpdate input = bench.resting_input(ada);
  input.sent = LocalTime(std::chrono::milliseconds(77));
  const LocalTime arrived = bench.now;
  EXPECT_EQ(bench.deliver(bench.datagram_of(ada, input)), ada.handle);
  bench.step(10);
  const auto sent = bench.drain_datagrams(ada);
  ASSERT_EQ(sent.size(), 10U);
  bench.hub->poll(VirtualClock(bench.now));
  EXPECT_TRUE(bench.drain_datagrams(ada).empty()) << "no newer state was published";
  proto::ServerUpdate update;
  proto::DatagramHeader header;
  ASSERT_EQ(proto::parse_header(sent.back(), header), proto::DropReason::kNone);
  EXPECT_EQ(header.sequence, 10U);
  EXPECT_EQ(header.connection, ada.connection);
  ASSERT_EQ(proto::parse_server_update(proto::payload_of(sent.back()), update), proto::DropReason::kNone);
  EXPECT_EQ(update.echoed_sent, input.sent);
  EXPECT_EQ(update.received, server_time_of_own_clock(arrived));
  EXPECT_EQ(update.sent, server_time_of_own_clock(bench.now));
  EXPECT_EQ(update.answered_input, input.input_tick);
}

/// Clock that advances by 10 µs at each reading, so that updates sent one after the other have different times.
class BusyClock final : public Clock {
 public:
  explicit BusyClock(LocalTime now) : now_(now) {}
  LocalTime now() const noexcept override { return now_ += std::chrono::microseconds(10); }

 private:
  mutable LocalTime now_;
};

TEST(StateStream, EachUpdateContainsItsOwnTimeOfSending) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada"), ben = bench.join("ben");
  bench.send_state(ada);
  bench.send_state(ben);
  bench.now += std::chrono::milliseconds(1);
  bench.rooms.front()->step(server_time_of_own_clock(bench.now));
  bench.hub->poll(BusyClock(bench.now));
  const auto of_ada = bench.newest_update(ada), of_ben = bench.newest_update(ben);
  ASSERT_TRUE(of_ada.has_value() && of_ben.has_value());
  EXPECT_EQ(of_ada->step, of_ben->step);
  EXPECT_GE(std::chrono::abs(of_ada->sent - of_ben->sent), std::chrono::microseconds(10));
  EXPECT_GT(std::min(of_ada->sent, of_ben->sent), server_time_of_own_clock(bench.now));
}

TEST(StateStream, DropsEachBadDatagramForItsOwnReason) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.send_state(ada);
  bench.send_state(ada);
  const auto reason_of = [&bench](const proto::Bytes& datagram, const std::function<bool(ConnectionHandle)>& may = {}) {
    const proto::DropCounters before = bench.hub->counters().received_drops;
    EXPECT_EQ(bench.hub->on_datagram(datagram, bench.now, may).connection, 0U);
    for (int i = 1; i < static_cast<int>(proto::DropReason::kCount); ++i) {
      const auto reason = static_cast<proto::DropReason>(i);
      if (bench.hub->counters().received_drops.count(reason) > before.count(reason)) return reason;
    }
    return proto::DropReason::kNone;
  };
  const auto next = [&] { return bench.datagram_of(ada, bench.resting_input(ada)); };
  EXPECT_EQ(reason_of(proto::Bytes(10)), proto::DropReason::kTooShort);
  EXPECT_EQ(reason_of(proto::Bytes(proto::kMaxDatagramBytes + 1)), proto::DropReason::kTooLong);
  proto::Bytes server_type = next();
  server_type[0] |= std::byte{0x08};
  EXPECT_EQ(reason_of(server_type), proto::DropReason::kType);
  proto::Bytes other_epoch = next();
  other_epoch[0] ^= std::byte{0x01};
  EXPECT_EQ(reason_of(other_epoch), proto::DropReason::kUnknownConnection);
  proto::Bytes other_connection = next();
  other_connection[4] ^= std::byte{0x01};
  EXPECT_EQ(reason_of(other_connection), proto::DropReason::kUnknownConnection);
  EXPECT_EQ(reason_of(next(), [](ConnectionHandle) { return false; }), proto::DropReason::kNotAllowed);
  const proto::Bytes older = next();
  const proto::Bytes newer = next();
  ASSERT_EQ(bench.deliver(newer), ada.handle);
  EXPECT_EQ(reason_of(newer), proto::DropReason::kDuplicate);
  EXPECT_EQ(reason_of(older), proto::DropReason::kLate);
  proto::Bytes cut = next();
  cut.resize(cut.size() - 3);
  EXPECT_EQ(reason_of(cut), proto::DropReason::kMalformed);
  proto::ClientUpdate far = bench.resting_input(ada);
  far.handle.X.p.x() = 2 * proto::kMaxPositionM;
  EXPECT_EQ(reason_of(bench.datagram_of(ada, far)), proto::DropReason::kNotFinite);
  EXPECT_EQ(bench.send_state(ada), ada.handle) << "none of them shut out the good one that follows";
}

TEST(StateStream, ADamagedDatagramFarAheadDoesNotShutOutTheGoodOnesBehindIt) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  ASSERT_EQ(bench.send_state(ada), ada.handle);
  test::BenchClient damaged = ada;
  damaged.sequence += 1000;
  proto::Bytes datagram = bench.datagram_of(damaged, bench.resting_input(damaged));
  datagram.resize(datagram.size() - 1);
  EXPECT_EQ(bench.deliver(datagram), 0U);
  EXPECT_EQ(bench.send_state(ada), ada.handle);
}

TEST(StateStream, AnotherConnectionsStateCannotBeForgedOverTcp) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_MANIPULATOR, "state-tcp");
  test::BenchClient mallory = bench.join("mallory", wire::ROLE_MANIPULATOR, "state-tcp");
  const proto::Bytes forged = bench.datagram_of(ada, bench.resting_input(ada));
  bench.send(mallory,
             message_of([&forged](auto& message) { message.set_state_datagram(forged.data(), forged.size()); }));
  EXPECT_EQ(bench.hub->counters().received_drops.count(proto::DropReason::kNotAllowed), 1U);
}

TEST(StateStream, StateOverTcpIsSkippedWhileControlBytesWait) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada", wire::ROLE_MANIPULATOR, "state-tcp");
  bench.step(5);
  EXPECT_EQ(bench.drain(ada).size(), 5U);
  EXPECT_TRUE(bench.drain_datagrams(ada).empty());
  bench.transport.queued = 1;
  bench.step(5);
  EXPECT_TRUE(bench.drain(ada).empty());
  EXPECT_EQ(bench.hub->counters().sent_drops.count(proto::DropReason::kOverwritten), 5U);
  bench.transport.queued = 0;
  bench.step();
  EXPECT_EQ(test::described(bench.drain(ada)), "state_datagram");
}

TEST(StateStream, CountsUnsentAndMissingDatagrams) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.send_state(ada);
  bench.step();
  bench.transport.takes_datagrams = false;
  bench.step(3);
  EXPECT_EQ(bench.hub->counters().sent_drops.count(proto::DropReason::kSendFailed), 3U);
  bench.transport.takes_datagrams = true;
  for (int i = 0; i < 4; ++i) {
    bench.now += std::chrono::milliseconds(1);
    bench.rooms.front()->step(server_time_of_own_clock(bench.now));
  }
  bench.hub->poll(VirtualClock(bench.now));
  EXPECT_EQ(bench.hub->counters().sent_drops.count(proto::DropReason::kOverwritten), 3U)
      << "of four steps the newest was sent";
  bench.send_state(ada);
  bench.send_state(ada);
  EXPECT_EQ(bench.hub->counters().received_drops.count(proto::DropReason::kOverwritten), 1U);
}

TEST(StateStream, ANewUserNeverGetsAnUpdateMadeForTheSeatsFormerUser) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  proto::ClientUpdate pulled = bench.resting_input(ada);
  pulled.handle.X.p.y() += 0.05;
  bench.deliver(bench.datagram_of(ada, pulled));
  bench.step(200);
  // The room publishes an update for ada. Before the hub sends it, ada leaves and ben gets the same seat and tool. Ben
  // must not receive it.
  bench.now += std::chrono::milliseconds(1);
  bench.rooms.front()->step(server_time_of_own_clock(bench.now));
  bench.send(ada, message_of([](auto& message) { message.mutable_leave(); }));
  test::BenchClient ben = bench.join("ben");
  ASSERT_EQ(ben.joined.tool(), ada.joined.tool());
  bench.send_state(ben);
  bench.hub->poll(VirtualClock(bench.now));
  EXPECT_TRUE(bench.drain_datagrams(ben).empty());
  bench.step();
  ASSERT_TRUE(bench.newest_update(ben).has_value());
  EXPECT_LT(std::abs(bench.newest_update(ben)->tool.X.p.y()), 0.01) << "the tool starts anew";
}

/// Joins with a deadband and sends the state of a hand at rest every millisecond. Returns the number of updates that
/// the client receives in 1 s.
std::size_t updates_in_a_second(double deadband) {
  test::HubBench bench;
  test::BenchClient ada = bench.connect();
  bench.greet(ada);
  wire::ClientControl join = test::HubBench::join_message("ada");
  join.mutable_join()->set_deadband(deadband);
  bench.send(ada, join);
  for (const wire::ServerControl& message : bench.drain(ada)) {
    if (message.has_joined()) ada.joined = message.joined();
  }
  const auto run = [&](int steps) {
    for (int i = 0; i < steps; ++i) {
      bench.send_state(ada);
      bench.step();
    }
  };
  run(200);
  bench.drain_datagrams(ada);
  run(1000);
  const std::size_t sent = bench.drain_datagrams(ada).size();
  EXPECT_EQ(bench.hub->counters().updates_suppressed > 0, deadband > 0);
  return sent;
}

TEST(StateStream, WithADeadbandAUserAtRestIsSentTheFloorRateAndNoLess) {
  EXPECT_EQ(updates_in_a_second(0), 1000U);
  EXPECT_EQ(updates_in_a_second(0.1), 100U);
}

}  // namespace
}  // namespace tandem::server
