// The 33-byte header of every state message, and the limits of all datagrams. WIRE.md is the normative text;
// tests/proto checks it against this code.
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
/// Offset of the tag at the end of the header; the bytes before it are authenticated unchanged.
inline constexpr std::size_t kTagOffset = kDatagramHeaderBytes - kTagBytes;
/// Fits an IPv6 path of minimum MTU with a margin for tunnels; never fragmented.
inline constexpr std::size_t kMaxDatagramBytes = 1200;
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kDatagramHeaderBytes;
/// Epochs have three bits.
inline constexpr std::uint8_t kMaxEpoch = 7;
/// Largest gap to the newest sequence (about 17 minutes at 1 kHz); a larger one counts as damage.
inline constexpr std::uint64_t kMaxSequenceJump = 1U << 20U;

using Bytes = std::vector<std::byte>;

enum class DatagramType : std::uint8_t {
  kClientUpdate = 0,
  kServerUpdate = 1,
  kPathResponse = 2,   ///< the client returns the 8 bytes of a challenge from its present address
  kPathChallenge = 3,  ///< the server checks whether its client is reachable at an address
};
/// Returns the type of the path message in the direction of that state.
constexpr DatagramType path_beside(DatagramType state) {
  return state == DatagramType::kClientUpdate ? DatagramType::kPathResponse : DatagramType::kPathChallenge;
}
/// Payload of a path message.
inline constexpr std::size_t kPathBytes = 8;

struct DatagramHeader {
  DatagramType type = DatagramType::kClientUpdate;
  std::uint8_t epoch = 0;  ///< 0..kMaxEpoch
  ConnectionId connection;
  std::uint64_t sequence = 0;
};

/// Appends the header to `out`.
void append_header(const DatagramHeader& header, Bytes& out);

/// Reads and checks the header: size limits, version, type, non-zero connection and sequence. DatagramSeal checks the
/// tag (datagram_seal.hpp).
/// Fails   with the reason; `out` is then unspecified.
DropReason parse_header(std::span<const std::byte> datagram, DatagramHeader& out);

inline std::span<const std::byte> payload_of(std::span<const std::byte> datagram) {
  return datagram.subspan(kDatagramHeaderBytes);
}

}  // namespace tandem::proto
