// The subset of the container format MCAP (https://mcap.dev/spec) that this project writes and reads.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::recording {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

/// Type of a record, stored in its first byte. Readers skip unknown types, except 0, which is invalid.
enum class Op : std::uint8_t {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kChunkIndex = 8,
  kAttachment = 9,
  kAttachmentIndex = 10,
  kStatistics = 11,
  kMetadata = 12,
  kMetadataIndex = 13,
  kSummaryOffset = 14,
  kDataEnd = 15,
};

/// A channel carries messages of one type. Its schema is a Protobuf FileDescriptorSet (encoding "protobuf"), which
/// describes the message type completely. A file can therefore be decoded without other files.
struct Channel {
  std::string topic;
  std::string type;  ///< full name of the message type
  Bytes descriptors;
};

/// A message. Times are in nanoseconds since 1970, UTC.
struct Message {
  std::uint16_t channel = 0;  ///< id of the channel within its file
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0;      ///< time of the recorded event
  std::uint64_t publish_ns = 0;  ///< equal to log_ns in this project
  std::span<const std::uint8_t> data;
};

std::uint32_t crc32(std::span<const std::uint8_t> bytes);

}  // namespace tandem::recording
