// The 33 bytes before every state message, and the limits that hold for all datagrams. WIRE.md is the
// normative text; tests/proto checks it against this code.
//
//   offset  size  field
//   0       1     version (3 bits, high) | type (2 bits) | epoch (3 bits, low)
//   1       8     connection id, big-endian
//   9       8     sequence, big-endian, from 1, per direction and epoch
//   17      16    tag of the AEAD; zero with --insecure (null cipher)
//   33      …     one protobuf message (ClientUpdate, ServerUpdate) or the 8 bytes of a path message, sealed
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/ids.hpp"
#include "proto/drop_reason.hpp"

namespace tandem::proto {

/// Version of everything on the wire, control and state; peers of another version are refused.
inline constexpr std::uint32_t kProtocolVersion = 3;
inline constexpr std::size_t kDatagramHeaderBytes = 33;
inline constexpr std::size_t kTagBytes = 16;
/// The tag is the end of the header; what is before it is authenticated as it stands.
inline constexpr std::size_t kTagOffset = kDatagramHeaderBytes - kTagBytes;
/// Fits an IPv6 path of minimum MTU with room for tunnels; never fragmented.
inline constexpr std::size_t kMaxDatagramBytes = 1200;
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kDatagramHeaderBytes;
/// Epochs have three bits.
inline constexpr std::uint8_t kMaxEpoch = 7;
/// A sequence farther ahead of the newest seen than this is not a gap but damage (about 17 minutes at 1 kHz).
inline constexpr std::uint64_t kMaxSequenceJump = 1U << 20U;

using Bytes = std::vector<std::byte>;

enum class DatagramType : std::uint8_t {
  kClientUpdate = 0,
  kServerUpdate = 1,
  kPathResponse = 2,   ///< the client says the 8 bytes of a challenge back, from where it is
  kPathChallenge = 3,  ///< the server asks an address whether its client is there
};
/// The path message that goes the way of that state.
constexpr DatagramType path_beside(DatagramType state) {
  return state == DatagramType::kClientUpdate ? DatagramType::kPathResponse : DatagramType::kPathChallenge;
}
/// Payload of the two path messages.
inline constexpr std::size_t kPathBytes = 8;

struct DatagramHeader {
  DatagramType type = DatagramType::kClientUpdate;
  std::uint8_t epoch = 0;  ///< 0..kMaxEpoch
  ConnectionId connection;
  std::uint64_t sequence = 0;
};

/// Appends the header to `out`.
void append_header(const DatagramHeader& header, Bytes& out);

/// Reads and checks the header: size limits, version, type, non-zero connection and sequence. The tag is checked by who
/// has the key (datagram_seal.hpp).
/// Fails   with the reason; `out` is then unspecified.
DropReason parse_header(std::span<const std::byte> datagram, DatagramHeader& out);

inline std::span<const std::byte> payload_of(std::span<const std::byte> datagram) {
  return datagram.subspan(kDatagramHeaderBytes);
}

}  // namespace tandem::proto
