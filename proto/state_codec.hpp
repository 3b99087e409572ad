// State structs ↔ datagram payloads. The only place where state protobufs are built or read.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proto/datagram.hpp"
#include "proto/state.hpp"

namespace tandem {

/// Appends `update` as one protobuf message; always fits (tested with every field at its largest).
void append_client_update(const ClientUpdate& update, Bytes& out);

/// Reads a payload. kMalformed or kNotFinite on anything else than a complete, bounded, finite update.
DropReason parse_client_update(std::span<const std::byte> payload, ClientUpdate& out);

/// Encodes one user's server updates within kMaxPayloadBytes, thinning what does not fit.
///
/// Priority (what is thinned last, first): 1 own tool, wrench, time stamps, energies: always sent;
/// 2 the body this user holds; 3 other users' tools; 4 bodies held by others; 5 moving bodies;
/// 6 resting bodies. Within 3–6 the one not sent for longest goes first, so each is sent in turn.
class ServerUpdateEncoder {
 public:
  void append(const ServerUpdate& update, Bytes& out);
  /// Bodies and users left out of the last message.
  std::size_t thinned() const { return thinned_; }

 private:
  std::size_t thinned_ = 0;
  std::uint64_t message_ = 0;
  std::vector<std::uint64_t> body_sent_;  ///< message in which each body was last sent, by body id
  std::vector<std::uint64_t> user_sent_;  ///< likewise by user id
};

DropReason parse_server_update(std::span<const std::byte> payload, ServerUpdate& out);

}  // namespace tandem
