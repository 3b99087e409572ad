// State stream of one user: passes received client updates to the mailbox of the room, and sends the room's updates as
// datagrams.
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "proto/datagram_channel.hpp"
#include "proto/state_codec.hpp"
#include "server/room/room_seats.hpp"

namespace tandem::server {

/// Sends states to one user, and receives the updates of that user's client.
///
/// Thread  io; send() also on the thread in SessionHub::help()
class StateStream {
 public:
  /// Sends a datagram. Returns false if it cannot be sent now.
  using Deliver = std::function<bool(std::span<const std::byte>)>;

  /// In      seats, counters  stored by reference; must outlive the stream
  StateStream(const RoomSeats& seats, const Seat& seat, const proto::DatagramChannel::Settings& settings,
              proto::ChannelCounters& counters);

  bool is_for(const proto::DatagramHeader& header) const { return channel_.is_for(header); }
  /// Number of accepted client updates.
  std::uint64_t taken() const { return taken_; }
  /// Returns whether a client update with a valid handle pose has been accepted; always false for an observer.
  bool has_hand() const { return has_hand_; }
  /// Passes the client update in the datagram to the room, or returns the reason for dropping it.
  proto::DropReason receive(const proto::DatagramHeader& header, std::span<const std::byte> datagram, LocalTime now);
  /// Returns a round-trip time: from sending a state to receiving the input that acknowledges it, minus the time for
  /// which the client held the state. Returns none if no state has been acknowledged for the first time since the last
  /// call.
  std::optional<Duration> pop_round_trip() { return std::exchange(round_trip_, std::nullopt); }
  /// Reads the number in the answer to a path challenge, or returns the reason for dropping the datagram.
  proto::DropReason receive_path(const proto::DatagramHeader& header, std::span<const std::byte> datagram,
                                 std::uint64_t& number) {
    return channel_.receive_path(header, datagram, number);
  }
  std::span<const std::byte> path_challenge(std::uint64_t number, LocalTime now) {
    return channel_.path_message(number, now);
  }
  /// Sends the room's update, unless the deadband suppresses it or the rate limit withholds it.
  ///
  /// In      is_blocked  true if state uses TCP and earlier bytes are still queued
  /// Out     number of bodies and users that did not fit into the datagram
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
  std::optional<Duration> round_trip_;                   ///< measurement that pop_round_trip() has not returned yet
  ServerTime acknowledged_{};                            ///< send time of the last acknowledged state
  proto::ClientMode mode_ = proto::ClientMode::kHandle;  ///< mode of the newest client update
  TickFaults unsent_faults_ = 0;                         ///< faults of the steps since the last sent update
  proto::OwnUpdate sent_;                                ///< last sent update; used only with a deadband
  std::size_t users_sent_ = 0;                           ///< number of users in that update
};

}  // namespace tandem::server
