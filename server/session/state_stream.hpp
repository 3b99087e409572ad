// The state half of a user's session: between the mailboxes of his room and the datagrams of his connection.
#pragma once

#include <functional>
#include <optional>

#include "proto/datagram_channel.hpp"
#include "proto/state_codec.hpp"
#include "server/room/room_seats.hpp"

namespace tandem::server {

/// Thread  io; send() also who helps it (SessionHub::help())
class StateStream {
 public:
  /// Hands over a datagram; false when it could not be sent now.
  using Deliver = std::function<bool(std::span<const std::byte>)>;

  /// In      seats, counters  must outlive the stream
  StateStream(const RoomSeats& seats, const Seat& seat, const proto::DatagramChannel::Settings& settings,
              proto::ChannelCounters& counters);

  bool is_for(const proto::DatagramHeader& header) const { return channel_.is_for(header); }
  /// Client updates that were taken, so far.
  std::uint64_t taken() const { return taken_; }
  /// A valid handle of a user with a tool has been taken.
  bool has_hand() const { return has_hand_; }
  /// Gives the client update in the datagram to the room, or says why it is dropped.
  proto::DropReason receive(const proto::DatagramHeader& header, std::span<const std::byte> datagram, LocalTime now);
  /// From the send of a state to the input that says it has come, less what the client had it for; none: it has said
  /// nothing of the kind yet.
  std::optional<Duration> round_trip() const { return round_trip_; }
  /// A path message: the number that it says back, or why it is dropped.
  proto::DropReason receive_path(const proto::DatagramHeader& header, std::span<const std::byte> datagram,
                                 std::uint64_t& number) {
    return channel_.receive_path(header, datagram, number);
  }
  std::span<const std::byte> path_challenge(std::uint64_t number, LocalTime now) {
    return channel_.path_message(number, now);
  }
  /// Sends what the room has published, unless it is suppressed or paced.
  ///
  /// In      is_blocked  state goes over TCP, and the connection has not taken all that was sent before
  /// Out     bodies and users that did not fit into the datagram
  std::size_t send(const RoomUpdate& published, bool is_blocked, LocalTime now, const Deliver& deliver);

 private:
  bool has_changed(const net::Deadband& deadband, Duration since, const proto::OwnUpdate& own, std::size_t users) const;

  const RoomSeats& seats_;
  Seat seat_;
  bool is_suppressing_;
  bool is_stream_;
  proto::ChannelCounters& counters_;
  proto::DatagramChannel channel_;
  proto::ServerUpdateEncoder encoder_;
  std::uint64_t taken_ = 0;
  bool has_hand_ = false;
  std::optional<Duration> round_trip_;
  proto::ClientMode mode_ = proto::ClientMode::kHandle;  ///< of the newest client update
  TickFaults unsent_faults_ = 0;                         ///< of steps that nothing was sent of
  proto::OwnUpdate sent_;                                ///< last, as published; only where it may suppress the next
  std::size_t users_sent_ = 0;                           ///< with it
};

}  // namespace tandem::server
