// The 33-byte header of every datagram, and the limits of all datagrams. WIRE.md is the normative specification, and
// tests/proto compares it with this code.
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

/// Version of the whole protocol, for control and state. Peers with a different version are refused.
inline constexpr std::uint32_t kProtocolVersion = 3;
inline constexpr std::size_t kDatagramHeaderBytes = 33;
inline constexpr std::size_t kTagBytes = 16;
/// Offset of the tag, the last field of the header. The bytes before the tag are authenticated but not encrypted.
inline constexpr std::size_t kTagOffset = kDatagramHeaderBytes - kTagBytes;
/// Maximum size of a datagram. It is below the smallest MTU of IPv6 (1280 bytes), with a margin for tunnels. No
/// datagram is therefore fragmented.
inline constexpr std::size_t kMaxDatagramBytes = 1200;
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kDatagramHeaderBytes;
/// Largest epoch, because the header stores it in three bits.
inline constexpr std::uint8_t kMaxEpoch = 7;
/// Maximum amount by which a sequence may exceed the newest received one, about 17 minutes at 1 kHz. A datagram with a
/// higher sequence is dropped.
inline constexpr std::uint64_t kMaxSequenceJump = 1U << 20U;

using Bytes = std::vector<std::byte>;

enum class DatagramType : std::uint8_t {
  kClientUpdate = 0,
  kServerUpdate = 1,
  kPathResponse = 2,   ///< response of the client, sent from its current address: the 8 bytes of a challenge
  kPathChallenge = 3,  ///< challenge of the server: checks whether the client receives at an address
};
/// Returns the type of path message (check of the client's network address) that is sent in the same direction as state
/// of the type `state`.
constexpr DatagramType path_beside(DatagramType state) {
  return state == DatagramType::kClientUpdate ? DatagramType::kPathResponse : DatagramType::kPathChallenge;
}
/// Size of the payload of a path message.
inline constexpr std::size_t kPathBytes = 8;

struct DatagramHeader {
  DatagramType type = DatagramType::kClientUpdate;
  std::uint8_t epoch = 0;  ///< number of the encryption key, 0..kMaxEpoch
  ConnectionId connection;
  std::uint64_t sequence = 0;
};

/// Appends the header to `out`.
void append_header(const DatagramHeader& header, Bytes& out);

/// Reads the header. Checks the size of the datagram, the version, and that connection and sequence are not zero.
/// Checks neither the type (read_header()) nor the tag (DatagramSeal).
/// Out     kNone, or the reason to drop the datagram; `out` is then unspecified
DropReason parse_header(std::span<const std::byte> datagram, DatagramHeader& out);

inline std::span<const std::byte> payload_of(std::span<const std::byte> datagram) {
  return datagram.subspan(kDatagramHeaderBytes);
}

}  // namespace tandem::proto
