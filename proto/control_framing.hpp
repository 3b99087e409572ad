// Control messages on a byte stream: a 4-byte big-endian length, then one protobuf message. A length is checked before
// any byte of its frame is stored, so that a peer cannot force an allocation by announcing a size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "tandem/control.pb.h"

namespace tandem::proto {

/// Bytes of the length before each frame's payload.
inline constexpr std::size_t kFrameLengthBytes = 4;
/// Largest frame; a larger one ends the connection before anything is allocated for it.
inline constexpr std::size_t kMaxControlBytes = 256 * 1024;
/// Largest frame of a client, whose messages are short.
inline constexpr std::size_t kMaxClientControlBytes = 4096;
/// Bytes of an asset in one AssetChunk.
inline constexpr std::size_t kAssetChunkBytes = 64 * 1024;
/// Bytes of the hash that names an asset.
inline constexpr std::size_t kAssetHashBytes = sizeof(Sha256);

/// Words of Hello.capabilities and Welcome.capabilities: transports of state that a side supports.
inline constexpr const char* kCapabilityStateUdp = "state-udp";  ///< in UDP datagrams
inline constexpr const char* kCapabilityStateTcp = "state-tcp";  ///< in state_datagram of the control connection

/// Appends length and message. Fails: std::length_error over kMaxControlBytes (a bug of the sender).
void append_frame(const google::protobuf::MessageLite& message, Bytes& out);

/// Collects stream bytes and cuts them into frames, independently of how the stream was divided into feeds.
///
/// Cost    amortised O(1) a byte; stores bytes that were fed and not yet taken, so take all frames after each feed()
class FrameReader {
 public:
  explicit FrameReader(std::size_t max_payload_bytes = kMaxControlBytes) : max_payload_bytes_(max_payload_bytes) {}

  /// Adds received bytes. Returns false once a frame announced more than max_payload_bytes: close the stream. The
  /// complete frames before it can still be taken.
  bool feed(std::span<const std::byte> bytes);
  /// Returns the next complete frame's payload, valid until the next call of feed() or next().
  std::optional<std::span<const std::byte>> next();
  bool has_next() const { return read_ != frame_; }

 private:
  std::size_t payload_size_at(std::size_t frame) const;
  void drop_taken_bytes();

  std::size_t max_payload_bytes_;
  Bytes buffer_;           ///< taken frames | complete frames | start of an incomplete one
  std::size_t read_ = 0;   ///< offset of the first complete frame
  std::size_t frame_ = 0;  ///< offset of the incomplete frame
  bool is_broken_ = false;
};

/// Parses one frame's payload.
///
/// Fails   false unless it is a message with its oneof set, all its numbers are finite, and its sizes and ports are
///         within the limits of WIRE.md; `out` is then unspecified
bool parse_control(std::span<const std::byte> payload, wire::ClientControl& out);
bool parse_control(std::span<const std::byte> payload, wire::ServerControl& out);

}  // namespace tandem::proto
