// Transfers state updates between the haptic thread's mailboxes and the datagrams of a connection.
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
  /// Function that sends a datagram; it returns false if the datagram could not be sent now.
  using Deliver = std::function<bool(std::span<const std::byte>)>;

  /// In      settings, mailboxes, counters  must outlive this
  StateStream(const SessionSettings& settings, ClientMailboxes& mailboxes, proto::ChannelCounters& counters);

  /// Starts the stream of a newly joined connection. Discards all state of the previous connection, and the pending
  /// client update of the haptic thread.
  /// In      secret  key material for the encryption of datagrams; without it they are not encrypted
  void begin(ConnectionId connection, std::uint8_t epoch, const std::optional<secure::Exported>& secret, LocalTime now);
  /// Ends the stream. After this call no datagrams are sent, and received datagrams are dropped as those of an unknown
  /// connection.
  void end() { channel_.reset(); }

  /// Publishes the server update in the datagram to the haptic thread, or returns the reason why the datagram was
  /// dropped. A path challenge of the server (a check of this client's address) is answered by a datagram.
  proto::DropReason receive(std::span<const std::byte> datagram, LocalTime now, const Deliver& answer);
  /// Sends a new client update, unless the deadband or the rate limit suppresses it. If there is no new update for
  /// `keep_alive`, sends the last one again.
  ///
  /// In      coupling    current coefficients; the deadband uses them to convert differences of pose to forces
  ///         is_blocked  true: state is sent over TCP, and the connection has not accepted all earlier bytes
  void send_newest(const haptics::CouplingParameters& coupling, bool is_blocked, LocalTime now, const Deliver& deliver);

  /// Returns true if an update was received since begin().
  bool has_received() const { return channel_ && channel_->has_received(); }
  /// Returns the time of the last received update, or of begin().
  LocalTime last_received() const { return channel_ ? channel_->last_received() : LocalTime{}; }
  /// Returns the last received update.
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
  std::optional<proto::DatagramChannel> channel_;  ///< channel of the joined connection; empty if not joined
  net::ClockSync clock_;
  ReceivedUpdate received_;     ///< newest server update
  proto::ClientUpdate newest_;  ///< newest client update of the haptic thread since begin()
  LocalTime newest_taken_{};
  proto::ClientUpdate sent_;  ///< last update that was sent
  // Step number and time of the newest received state.
  Step newest_step_;
  ServerTime newest_stepped_{};
};

}  // namespace tandem::client
