// Converts state structs to datagram payloads and back. No other code encodes or decodes state messages.
//
// Memory: after its first messages, a thread that encodes or parses at 1 kHz allocates nothing, except for growth of
// `out`. Parsed messages are placed in an arena that each thread reuses. Server updates are encoded without an arena,
// and each thread caches recently encoded items.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <span>

#include "proto/datagram.hpp"
#include "proto/state.hpp"

namespace tandem::proto {

/// Speeds below which a body counts as at rest, so that its twist is not sent. A receiver that assumes rest for 0.1 s
/// makes an error of at most 10 µm and 0.1 mrad.
inline constexpr double kRestSpeedMPerS = 1e-4;
inline constexpr double kRestTurnRadPerS = 1e-3;

/// Appends `update` as one Protobuf message, which always fits into a datagram. (A test encodes the largest value of
/// every field.)
void append_client_update(const ClientUpdate& update, Bytes& out);

/// Parses a payload; unknown fields are skipped.
///
/// Fails   kMalformed: the message is invalid or too long, or a required part is missing. kNotFinite: a number is NaN,
///         infinite or outside the limits in state.hpp. `out` is then unspecified
DropReason parse_client_update(std::span<const std::byte> payload, ClientUpdate& out);

/// Encodes the server update of each step for one user within kMaxPayloadBytes. Items that do not fit are omitted
/// (thinning).
///
/// Priority, highest first:
///   1 own tool, wrench, time stamps, energies: always sent
///   2 the body that this user holds
///   3 other users' tools
///   4 bodies held by others
///   5 moving bodies, and those that have stopped since they were last sent
///   6 resting bodies
/// Within each of the classes 3 to 6, the item that was not sent for the longest time comes first.
/// A full class must not prevent the classes below it from being sent. Therefore an item is overdue if it was not sent
/// for kOverdueMessages messages. In each message, up to kOverduePerMessage overdue items precede class 3. Every item
/// is thus sent at least once in kMaxWaitMessages messages.
///
/// A body or user that exceeds the limits in state.hpp is omitted, because it would make the whole message unreadable.
class ServerUpdateEncoder {
 public:
  static constexpr std::uint64_t kOverdueMessages = 16;
  static constexpr std::size_t kOverduePerMessage = 4;
  /// Maximum number of messages between two transmissions of an item. Worst case: an item becomes overdue together with
  /// all other items, of which each message contains kOverduePerMessage.
  static constexpr std::uint64_t kMaxWaitMessages =
      kOverdueMessages + (kMaxBodies + kMaxUsers + kOverduePerMessage - 1) / kOverduePerMessage;

  /// Appends one protobuf message of at most kMaxPayloadBytes.
  ///
  /// In      users  all users of the room
  ///         but    user to omit from the message, normally its receiver; an invalid id omits nobody
  void append(const OwnUpdate& own, std::span<const BodyState> bodies, std::span<const OtherUserState> users,
              UserId but, Bytes& out);
  void append(const ServerUpdate& update, Bytes& out) { append(update, update.bodies, update.users, UserId{}, out); }
  /// Returns the number of bodies and users that were omitted from the last message.
  std::size_t thinned() const { return thinned_; }

 private:
  /// Record of the message in which a body or user was last sent.
  struct Turn {
    std::uint32_t id = 0;
    std::uint64_t sent = 0;  ///< number of the message in which the item was last sent; 0: never
    /// Position in that message. It determines the order of items that were sent in the same message.
    std::size_t place = 0;
    bool was_moving = false;
  };

  std::size_t thinned_ = 0;
  std::uint64_t message_ = 0;
  boost::container::static_vector<Turn, kMaxBodies> body_turns_;  ///< one entry for each body of the last message
  boost::container::static_vector<Turn, kMaxUsers> user_turns_;   ///< one entry for each user of the last message
};

/// Parses a payload. Fails like parse_client_update(). In addition, returns kMalformed if an id is zero or repeated, or
/// if there are more bodies or users than a room can have.
DropReason parse_server_update(std::span<const std::byte> payload, ServerUpdate& out);

}  // namespace tandem::proto
