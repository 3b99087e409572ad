// Control messages in a byte stream: a 4-byte big-endian length, then one Protobuf message. The length is checked
// before any byte of the message is stored. A peer therefore cannot cause a large allocation by sending a large length.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "tandem/control.pb.h"

namespace tandem::proto {

/// Size of the length field before each payload.
inline constexpr std::size_t kFrameLengthBytes = 4;
/// Maximum payload of a frame. If a peer sends a larger length, the connection is closed before memory is allocated.
inline constexpr std::size_t kMaxControlBytes = 256 * 1024;
/// Maximum payload that a server accepts from a client. It is small, because all messages of clients are short.
inline constexpr std::size_t kMaxClientControlBytes = 4096;
/// Maximum number of bytes of an asset in one AssetChunk.
inline constexpr std::size_t kAssetChunkBytes = 64 * 1024;
/// Size of the hash that identifies an asset.
inline constexpr std::size_t kAssetHashBytes = sizeof(Sha256);

/// Values of Hello.capabilities and Welcome.capabilities. They name the transports by which the sender of the message
/// can exchange state.
inline constexpr const char* kCapabilityStateUdp = "state-udp";  ///< state is sent in UDP datagrams
/// State is sent inside control messages, in the field state_datagram.
inline constexpr const char* kCapabilityStateTcp = "state-tcp";

/// Appends a frame: the length and the message.
/// Fails   std::length_error: the message is larger than kMaxControlBytes, which is a bug of the sender
void append_frame(const google::protobuf::MessageLite& message, Bytes& out);

/// Splits a received byte stream into frames. The result does not depend on how the bytes are distributed over calls of
/// feed().
///
/// Cost    amortised O(1) per byte. Bytes are stored until next() has returned their frame. After each feed(), call
///         next() until it returns nothing, so that the memory does not grow
class FrameReader {
 public:
  explicit FrameReader(std::size_t max_payload_bytes = kMaxControlBytes) : max_payload_bytes_(max_payload_bytes) {}

  /// Adds received bytes. If a frame has a length above max_payload_bytes, returns false, now and in all later calls.
  /// The caller must then close the stream. Complete frames that were received before can still be read.
  bool feed(std::span<const std::byte> bytes);
  /// Returns the payload of the next complete frame; nothing if there is none. The payload remains valid until the next
  /// call of feed() or next().
  std::optional<std::span<const std::byte>> next();
  bool has_next() const { return read_ != frame_; }

 private:
  std::size_t payload_size_at(std::size_t frame) const;
  void drop_taken_bytes();

  std::size_t max_payload_bytes_;
  Bytes buffer_;           ///< frames already returned, then complete frames, then an incomplete frame
  std::size_t read_ = 0;   ///< offset of the first complete frame
  std::size_t frame_ = 0;  ///< offset of the incomplete frame
  bool is_broken_ = false;
};

/// Parses the payload of one frame.
///
/// Fails   returns false, and `out` is unspecified, in these cases: the payload is no message; the message's oneof is
///         not set; a number is not finite; a size or port exceeds a limit of WIRE.md
bool parse_control(std::span<const std::byte> payload, wire::ClientControl& out);
bool parse_control(std::span<const std::byte> payload, wire::ServerControl& out);

}  // namespace tandem::proto
