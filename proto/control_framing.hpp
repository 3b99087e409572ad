// Control messages on a byte stream: a 4-byte big-endian length, then one protobuf message.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/datagram.hpp"
#include "tandem/control.pb.h"

namespace tandem {

/// Larger frames end the connection before anything is allocated for them.
inline constexpr std::size_t kMaxControlBytes = 256 * 1024;
/// Bytes of an asset in one AssetChunk.
inline constexpr std::size_t kAssetChunkBytes = 64 * 1024;

/// Appends length and message. Fails: std::length_error over kMaxControlBytes (a bug of the sender).
void append_frame(const google::protobuf::MessageLite& message, Bytes& out);

/// Collects stream bytes and cuts them into frames.
class FrameReader {
 public:
  /// Adds bytes as they came. False once a frame announced more than kMaxControlBytes: close the stream.
  bool feed(std::span<const std::byte> bytes);
  /// The next whole frame's payload, valid until the next call of feed() or next().
  std::optional<std::span<const std::byte>> next();

 private:
  Bytes buffer_;
  std::size_t read_ = 0;
  bool is_broken_ = false;
};

/// Parses one frame's payload; false on anything but a complete message with its oneof set.
bool parse_control(std::span<const std::byte> payload, wire::ClientControl& out);
bool parse_control(std::span<const std::byte> payload, wire::ServerControl& out);

}  // namespace tandem
