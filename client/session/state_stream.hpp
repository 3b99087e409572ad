// State part of a client's session, between the haptic thread's mailboxes and the datagrams of one connection.
#pragma once

#include <functional>
#include <optional>

#include "client/exchange/mailboxes.hpp"
#include "client/session/session.hpp"
#include "common/net/clock_sync.hpp"
#include "proto/datagram_channel.hpp"

namespace tandem::client {

/// Thread  io
class StateStream {
 public:
  /// Sends a datagram; returns false if it could not be sent now.
  using Deliver = std::function<bool(std::span<const std::byte>)>;

  /// In      all arguments  must outlive the stream
  StateStream(const SessionSettings& settings, ClientMailboxes& mailboxes, proto::ChannelCounters& counters);

  /// Starts a joined connection. Discards all state of the previous one, and pending updates of the haptic thread.
  /// In      secret  for the encryption of its datagrams; none: null cipher
  void begin(ConnectionId connection, std::uint8_t epoch, const std::optional<secure::Exported>& secret, LocalTime now);
  /// Drops all datagrams as of an unknown connection from now on, and sends none.
  void end() { channel_.reset(); }

  /// Publishes the server update in the datagram, or returns why it was dropped. Answers a path challenge of the
  /// server.
  proto::DropReason receive(std::span<const std::byte> datagram, LocalTime now, const Deliver& answer);
  /// Sends the newest haptic update, unless it is suppressed or paced. Without a new one for `keep_alive`, repeats the
  /// last.
  ///
  /// In      coupling    current; converts pose differences to force for the deadband
  ///         is_blocked  state is sent over TCP, and the connection has not accepted all earlier bytes
  void send_newest(const haptics::CouplingParameters& coupling, bool is_blocked, LocalTime now, const Deliver& deliver);

  /// True if an update was received since begin().
  bool has_received() const { return channel_ && channel_->has_received(); }
  /// Time of the last update, or of begin().
  LocalTime last_received() const { return channel_ ? channel_->last_received() : LocalTime{}; }
  /// Last received update.
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
  proto::ClientUpdate newest_;  ///< newest of the haptic thread since begin()
  LocalTime newest_taken_{};
  proto::ClientUpdate sent_;  ///< last sent
  // Step number and time of the newest received state.
  Step newest_step_;
  ServerTime newest_stepped_{};
};

}  // namespace tandem::client
