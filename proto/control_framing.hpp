// Control messages on a byte stream: a 4-byte big-endian length, then one protobuf message. A length is
// checked before any byte of its frame is kept, so a peer cannot make us allocate by announcing a size.
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
/// Larger frames end the connection before anything is allocated for them.
inline constexpr std::size_t kMaxControlBytes = 256 * 1024;
/// Likewise of a client's, which are short: what is not read costs nothing.
inline constexpr std::size_t kMaxClientControlBytes = 4096;
/// Bytes of an asset in one AssetChunk.
inline constexpr std::size_t kAssetChunkBytes = 64 * 1024;
/// Bytes of the hash that names an asset.
inline constexpr std::size_t kAssetHashBytes = sizeof(Sha256);

/// Words of Hello.capabilities and Welcome.capabilities: how that side can carry state.
inline constexpr const char* kCapabilityStateUdp = "state-udp";  ///< in UDP datagrams
inline constexpr const char* kCapabilityStateTcp = "state-tcp";  ///< in state_datagram of the control connection

/// Appends length and message. Fails: std::length_error over kMaxControlBytes (a bug of the sender).
void append_frame(const google::protobuf::MessageLite& message, Bytes& out);

/// Collects stream bytes and cuts them into frames, the same ones however the stream was cut into feeds.
///
/// Cost    amortised O(1) a byte; holds what was fed and not yet taken, so take all frames after each feed()
class FrameReader {
 public:
  explicit FrameReader(std::size_t max_payload_bytes = kMaxControlBytes) : max_payload_bytes_(max_payload_bytes) {}

  /// Adds bytes as they came. False once a frame announced more than max_payload_bytes: close the stream. The
  /// whole frames before that one can still be taken.
  bool feed(std::span<const std::byte> bytes);
  /// The next whole frame's payload, valid until the next call of feed() or next().
  std::optional<std::span<const std::byte>> next();
  bool has_next() const { return read_ != frame_; }

 private:
  std::size_t payload_size_at(std::size_t frame) const;
  void drop_taken_bytes();

  std::size_t max_payload_bytes_;
  Bytes buffer_;           ///< taken frames | whole frames | the beginning of one more
  std::size_t read_ = 0;   ///< where the first whole frame starts
  std::size_t frame_ = 0;  ///< where the unfinished frame starts
  bool is_broken_ = false;
};

/// Parses one frame's payload.
///
/// Fails   false on anything but a message with its oneof set, every number in it finite, and the fields that
///         name sizes and ports within the limits of WIRE.md; `out` is then unspecified
bool parse_control(std::span<const std::byte> payload, wire::ClientControl& out);
bool parse_control(std::span<const std::byte> payload, wire::ServerControl& out);

}  // namespace tandem::proto
