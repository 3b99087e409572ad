#include "proto/datagram_channel.hpp"

#include <gtest/gtest.h>

#include "proto/state_codec.hpp"

namespace tandem::proto {
namespace {

constexpr Duration kMs = std::chrono::milliseconds(1);

/// Both ends of one connection. The server's clock is 50 s ahead of the client's.
class DatagramChannelTest : public ::testing::Test {
 protected:
  explicit DatagramChannelTest(double deadband = 0, bool is_stream = false)
      : client_(settings(DatagramType::kClientUpdate, deadband, is_stream), client_counters_),
        server_(settings(DatagramType::kServerUpdate, deadband, is_stream), server_counters_) {}

  static DatagramChannel::Settings settings(DatagramType sends, double deadband, bool is_stream) {
    return {.sends = sends,
            .connection = ConnectionId{7},
            .epoch = 3,
            .deadband = deadband,
            .max_rate_hz = 1000,
            .is_stream = is_stream};
  }

  Bytes from_client(ClientUpdate update = {}) {
    return sent_by(client_, update, now_, [](const ClientUpdate& u, Bytes& out) { append_client_update(u, out); });
  }
  Bytes from_server(ServerUpdate update = {}) {
    return sent_by(server_, update, server_now(),
                   [](const ServerUpdate& u, Bytes& out) { ServerUpdateEncoder().append(u, out); });
  }
  template <class Update, class Append>
  static Bytes sent_by(DatagramChannel& channel, Update& update, LocalTime now, const Append& append) {
    Bytes datagram;
    channel.send(update, now, false, append, [&datagram](std::span<const std::byte> bytes) {
      datagram.assign(bytes.begin(), bytes.end());
      return true;
    });
    return datagram;
  }

  DropReason to_server(const Bytes& datagram, ClientUpdate* out = nullptr) {
    ClientUpdate update;
    const DropReason reason = given_to(server_, DatagramType::kClientUpdate, datagram, server_now(), update,
                                       [](auto payload, ClientUpdate& u) { return parse_client_update(payload, u); });
    if (out != nullptr) *out = update;
    return reason;
  }
  DropReason to_client(const Bytes& datagram, ServerUpdate* out = nullptr) {
    ServerUpdate update;
    const DropReason reason = given_to(client_, DatagramType::kServerUpdate, datagram, now_, update,
                                       [](auto payload, ServerUpdate& u) { return parse_server_update(payload, u); });
    if (out != nullptr) *out = update;
    return reason;
  }
  template <class Update, class Read>
  static DropReason given_to(DatagramChannel& channel, DatagramType type, const Bytes& datagram, LocalTime now,
                             Update& update, const Read& read) {
    DatagramHeader header;
    if (const DropReason reason = read_header(datagram, type, header); reason != DropReason::kNone) return reason;
    if (!channel.is_for(header)) return DropReason::kUnknownConnection;
    return channel.receive(header, datagram, now, update, read);
  }

  LocalTime server_now() const { return now_ + std::chrono::seconds(50); }

  LocalTime now_{std::chrono::seconds(10)};
  ChannelCounters client_counters_;
  ChannelCounters server_counters_;
  DatagramChannel client_;
  DatagramChannel server_;
};

TEST_F(DatagramChannelTest, AcceptsOnlyDatagramsNewerThanAllEarlierOnes) {
  const Bytes first = from_client(), second = from_client(), third = from_client();
  EXPECT_EQ(to_server(second), DropReason::kNone);
  EXPECT_EQ(to_server(second), DropReason::kDuplicate);
  EXPECT_EQ(to_server(first), DropReason::kLate);
  EXPECT_EQ(to_server(third), DropReason::kNone);
}

TEST_F(DatagramChannelTest, AnImpossibleJumpDoesNotBlockLaterDatagrams) {
  Bytes far = from_client();
  far[10] = std::byte{1};  // sets a bit of the sequence number with the value 2^48
  EXPECT_EQ(to_server(far), DropReason::kSequenceJump);
  EXPECT_EQ(to_server(from_client()), DropReason::kNone);
}

TEST_F(DatagramChannelTest, AnUnreadableDatagramBlocksNothingAndIsNotEchoed) {
  ASSERT_EQ(to_server(from_client()), DropReason::kNone);
  const LocalTime received_at = now_;
  now_ += kMs;
  const Bytes good = from_client();
  Bytes damaged = from_client();
  damaged.pop_back();
  EXPECT_EQ(to_server(damaged), DropReason::kMalformed);
  EXPECT_EQ(server_.last_received(), received_at + std::chrono::seconds(50));
  EXPECT_EQ(to_server(good), DropReason::kNone);
}

TEST_F(DatagramChannelTest, RefusesItsOwnDirectionAndOtherConnectionsAndEpochs) {
  EXPECT_EQ(to_client(from_client()), DropReason::kType);
  Bytes other_epoch = from_client(), other_connection = from_client();
  other_epoch[0] ^= std::byte{1};
  other_connection[3] ^= std::byte{1};
  EXPECT_EQ(to_server(other_epoch), DropReason::kUnknownConnection);
  EXPECT_EQ(to_server(other_connection), DropReason::kUnknownConnection);
}

TEST_F(DatagramChannelTest, EachEndStampsItsDatagramsAndEchoesTheNewestReceivedStamp) {
  ClientUpdate at_server;
  ServerUpdate at_client;
  const LocalTime t1 = now_;
  Bytes up = from_client();
  now_ += 4 * kMs;
  ASSERT_EQ(to_server(up, &at_server), DropReason::kNone);
  EXPECT_EQ(at_server.sent, t1);
  EXPECT_EQ(at_server.acknowledged_sent, ServerTime{}) << "no datagram was received";
  const ServerTime t2 = server_time_of_own_clock(server_now());
  now_ += 2 * kMs;
  const ServerTime t3 = server_time_of_own_clock(server_now());
  ServerUpdate update;
  update.step = Step{9};
  const Bytes down = from_server(update);
  now_ += 5 * kMs;
  ASSERT_EQ(to_client(down, &at_client), DropReason::kNone);
  EXPECT_EQ(at_client.echoed_sent, t1);
  EXPECT_EQ(at_client.received, t2);
  EXPECT_EQ(at_client.sent, t3);
  now_ += 3 * kMs;
  up = from_client();
  ASSERT_EQ(to_server(up, &at_server), DropReason::kNone);
  EXPECT_EQ(at_server.acknowledged_step, Step{9});
  EXPECT_EQ(at_server.acknowledged_sent, t3);
  EXPECT_EQ(at_server.acknowledged_held, 3 * kMs);
}

TEST_F(DatagramChannelTest, CountsWhatTheLoopOverwroteAndWhatTheNetworkDidNotTake) {
  for (const std::uint64_t number : {5U, 6U, 9U}) client_.count_overwritten(number);
  EXPECT_EQ(client_counters_.sent_drops.count(DropReason::kOverwritten), 2U);
  ClientUpdate update;
  client_.send(update, now_, false, append_client_update, [](auto) { return false; });
  EXPECT_EQ(client_counters_.sent_drops.count(DropReason::kSendFailed), 1U);
  EXPECT_EQ(client_counters_.datagrams_sent, 0U);
}

TEST_F(DatagramChannelTest, ABlockedStreamUsesNoSequence) {
  ClientUpdate update;
  client_.send(update, now_, true, append_client_update, [](auto) { return true; });
  EXPECT_EQ(client_counters_.sent_drops.count(DropReason::kOverwritten), 1U);
  DatagramHeader header;
  ASSERT_EQ(parse_header(from_client(), header), DropReason::kNone);
  EXPECT_EQ(header.sequence, 1U);
}

TEST_F(DatagramChannelTest, OnAQueueingLinkDatagramsArePacedExceptUrgentOnes) {
  const auto never_called = [](const net::Deadband&, Duration) { return ADD_FAILURE(), true; };
  // Simulates a link whose queue grows: each datagram is delayed by 1 ms more than the previous one.
  for (int i = 0; i < 200; ++i) {
    now_ += kMs;
    if (!client_.admits(now_, true, never_called)) continue;
    from_client();
    ServerUpdate echo;
    echo.echoed_sent = now_;
    echo.received = echo.sent = server_time_of_own_clock(server_now() + i * kMs);
    Bytes datagram;
    append_header({DatagramType::kServerUpdate, 3, ConnectionId{7}, static_cast<std::uint64_t>(i) + 1}, datagram);
    ServerUpdateEncoder().append(echo, datagram);
    ASSERT_EQ(to_client(datagram), DropReason::kNone);
  }
  EXPECT_GT(client_counters_.updates_paced, 100U) << "noticed within kQueue + kShort, 80 ms; then nine of ten wait";
  from_client();
  now_ += kMs;
  EXPECT_FALSE(client_.admits(now_, true, never_called));
  EXPECT_TRUE(client_.admits(now_, false, never_called));
  EXPECT_TRUE(client_.admits(now_ + 2 * net::kDeadbandFloor, true, never_called)) << "the floor rate is always carried";
}

class SuppressingChannelTest : public DatagramChannelTest {
 protected:
  SuppressingChannelTest() : DatagramChannelTest(0.1) {}
};

TEST_F(SuppressingChannelTest, SuppressesUnchangedValuesButNotLongerThanTheFloor) {
  from_client();
  const auto expects = [](bool has_changed, Duration expected) {
    return [=](const net::Deadband&, Duration since) {
      EXPECT_EQ(since, expected);
      return has_changed;
    };
  };
  EXPECT_FALSE(client_.admits(now_ + kMs, true, expects(false, kMs)));
  EXPECT_EQ(client_counters_.updates_suppressed, 1U);
  EXPECT_TRUE(client_.admits(now_ + kMs, true, expects(true, kMs)));
  EXPECT_TRUE(client_.admits(now_ + net::kDeadbandFloor, true, expects(false, net::kDeadbandFloor)));
  EXPECT_EQ(client_counters_.updates_suppressed, 1U);
}

}  // namespace
}  // namespace tandem::proto
