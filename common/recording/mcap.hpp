// The parts of the container format MCAP (https://mcap.dev/spec) that this project writes and reads.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::recording {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

/// What a record is, by its first byte. Readers skip all others, but 0, which is none.
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

/// A stream of messages of one type. The schema is a FileDescriptorSet (encoding "protobuf"), so that a file explains
/// itself.
struct Channel {
  std::string topic;
  std::string type;  ///< full name of the message
  Bytes descriptors;
};

/// Times are since 1970, UTC.
struct Message {
  std::uint16_t channel = 0;  ///< index into the channels of the writer; of the reader's
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0;      ///< of what happened
  std::uint64_t publish_ns = 0;  ///< the same here
  std::span<const std::uint8_t> data;
};

std::uint32_t crc32(std::span<const std::uint8_t> bytes);

}  // namespace tandem::recording
