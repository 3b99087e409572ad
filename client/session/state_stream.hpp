// The state half of a client's session: between the haptic thread's mailboxes and the datagrams of one connection.
#pragma once

#include <functional>
#include <optional>

#include "client/haptics/mailboxes.hpp"
#include "client/session/session.hpp"
#include "common/net/clock_sync.hpp"
#include "proto/datagram_channel.hpp"

namespace tandem::client {

/// Thread  io
class StateStream {
 public:
  /// Hands over a datagram; false when it could not be sent now.
  using Deliver = std::function<bool(std::span<const std::byte>)>;

  /// All must outlive the stream.
  StateStream(const SessionSettings& settings, ClientMailboxes& mailboxes, proto::ChannelCounters& counters);

  /// A connection has joined. Forgets all of the one before, and what the haptic thread wrote so far.
  /// In      secret  for the seals of its datagrams; none: null cipher
  void begin(ConnectionId connection, std::uint8_t epoch, const std::optional<secure::Exported>& secret, LocalTime now);
  /// From now on every datagram is of an unknown connection, and none is sent.
  void end() { channel_.reset(); }

  /// Publishes the server update in the datagram, or says why it is dropped. Asked whether the client is here, answers.
  proto::DropReason receive(std::span<const std::byte> datagram, LocalTime now, const Deliver& answer);
  /// Sends the newest haptic update, unless it is suppressed or paced; without a new one for `keep_alive` the last.
  ///
  /// In      coupling    in force: places are compared by the force that it makes of them
  ///         is_blocked  state goes over TCP, and the connection has not taken all that was sent before
  void send_newest(const haptics::CouplingParameters& coupling, bool is_blocked, LocalTime now, const Deliver& deliver);

  /// Since begin().
  bool has_heard() const { return channel_ && channel_->has_heard(); }
  /// When the last update came, or begin() was.
  LocalTime last_heard() const { return channel_ ? channel_->last_heard() : LocalTime{}; }
  /// The update received last.
  const proto::ServerUpdate& newest_update() const { return received_.update; }
  net::ClockSync& clock() { return clock_; }

 private:
  proto::DropReason answer_challenge(const proto::DatagramHeader& header, std::span<const std::byte> datagram,
                                     LocalTime now, const Deliver& answer);
  void publish_received(LocalTime now);
  bool has_changed(const net::Deadband& deadband, Duration since, const haptics::CouplingParameters& coupling) const;
  bool is_urgent() const;
  void send(proto::ClientUpdate update, bool is_blocked, LocalTime now, const Deliver& deliver);

  const SessionSettings& settings_;
  ClientMailboxes& mailboxes_;
  proto::ChannelCounters& counters_;
  std::optional<proto::DatagramChannel> channel_;  ///< while joined
  net::ClockSync clock_;
  ReceivedUpdate received_;     ///< newest
  proto::ClientUpdate newest_;  ///< of the haptic thread since begin()
  LocalTime newest_taken_{};
  proto::ClientUpdate sent_;  ///< last
  // Of the newest state received.
  Step newest_step_;
  ServerTime newest_stepped_{};
};

}  // namespace tandem::client
