// State structs ↔ datagram payloads. The only place where state protobufs are built or read.
//
// Messages live in a per-thread arena that is reused. Server updates are written without one and reuse what the thread
// encoded recently. A thread that codes at 1 kHz therefore allocates nothing after its first messages (growth of `out`
// aside).
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <span>

#include "proto/datagram.hpp"
#include "proto/state.hpp"

namespace tandem::proto {

/// Speed below which a body counts as resting and its twist is not sent; after 0.1 s the error is 10 µm and 0.1 mrad.
inline constexpr double kRestSpeedMPerS = 1e-4;
inline constexpr double kRestTurnRadPerS = 1e-3;

/// Appends `update` as one protobuf message; always fits (tested with every field at its largest).
void append_client_update(const ClientUpdate& update, Bytes& out);

/// Reads a payload.
///
/// Fails   kMalformed for an invalid or too long message, or one without a required part; kNotFinite for a number that
///         is NaN, infinite or outside the limits in state.hpp. `out` is then unspecified. Unknown fields are skipped.
DropReason parse_client_update(std::span<const std::byte> payload, ClientUpdate& out);

/// Encodes one user's server updates within kMaxPayloadBytes, thinning the rest.
///
/// Priority, highest first:
///   1 own tool, wrench, time stamps, energies: always sent
///   2 the body that this user holds
///   3 other users' tools
///   4 bodies held by others
///   5 moving bodies, and those that have stopped since they were last sent
///   6 resting bodies
/// Within 3–6 the item not sent for longest is first. Up to kOverduePerMessage items not sent for
/// kOverdueMessages precede class 3, so that a full class does not starve those below it: every item is sent at least
/// once in kMaxWaitMessages.
///
/// A body or user outside the limits in state.hpp is left out, because it would make the whole message unreadable.
class ServerUpdateEncoder {
 public:
  static constexpr std::uint64_t kOverdueMessages = 16;
  static constexpr std::size_t kOverduePerMessage = 4;
  /// Longest wait: an overdue item waits at most for all others, kOverduePerMessage of them a message.
  static constexpr std::uint64_t kMaxWaitMessages =
      kOverdueMessages + (kMaxBodies + kMaxUsers + kOverduePerMessage - 1) / kOverduePerMessage;

  /// Appends one protobuf message of at most kMaxPayloadBytes.
  ///
  /// In      users  all users of the room; `but` is the one to leave out
  void append(const OwnUpdate& own, std::span<const BodyState> bodies, std::span<const OtherUserState> users,
              UserId but, Bytes& out);
  void append(const ServerUpdate& update, Bytes& out) { append(update, update.bodies, update.users, UserId{}, out); }
  /// Bodies and users left out of the last message.
  std::size_t thinned() const { return thinned_; }

 private:
  /// Last transmission of one body or user.
  struct Turn {
    std::uint32_t id = 0;
    std::uint64_t sent = 0;  ///< message in which it was last sent; 0: never
    std::size_t place = 0;   ///< position in that message, so that items of one message keep their order in the next
    bool was_moving = false;
  };

  std::size_t thinned_ = 0;
  std::uint64_t message_ = 0;
  boost::container::static_vector<Turn, kMaxBodies> body_turns_;  ///< in the order of the bodies
  boost::container::static_vector<Turn, kMaxUsers> user_turns_;   ///< in the order of the users
};

/// Reads a payload; fails like parse_client_update(), and with kMalformed for a zero or repeated id or more bodies or
/// users than a room can have.
DropReason parse_server_update(std::span<const std::byte> payload, ServerUpdate& out);

}  // namespace tandem::proto
