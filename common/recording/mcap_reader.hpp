// Reads the messages of an MCAP file in the order of writing. The bytes are not trusted. Reading ends at a record that
// exceeds the limits, has a wrong checksum or does not fit the others; the reader reports its position.
#pragma once

#include <istream>
#include <map>
#include <optional>

#include "common/recording/mcap.hpp"

namespace tandem::recording {

/// Reads records in sequence, without the index: a file that is cut anywhere is readable up to its last whole chunk.
///
/// Limits  64 MiB for a record and for an unpacked chunk, 1024 channels; messages in chunks with a checksum,
///         uncompressed or zstd; no attachments
/// Thread  one at a time
class McapReader {
 public:
  /// State of the file's end.
  enum class End : std::uint8_t { kNotYet, kWhole, kCut, kDamaged };

  /// In      in  binary stream at the start of the file; outlives this
  explicit McapReader(std::istream& in);

  /// The next message; empty at the end, see end(). Its data remain valid until the next call.
  std::optional<Message> next();
  /// The channel of a message, among those read so far; null if there is none.
  const Channel* channel(std::uint16_t id) const;
  End end() const { return end_; }
  /// Readable reason why reading ended; empty for a whole file.
  const std::string& why() const { return why_; }
  /// Position in the file of the last record, where the file is cut or damaged.
  std::uint64_t offset() const { return record_at_; }
  /// Number of messages that next() returned.
  std::uint64_t messages() const { return messages_; }
  /// True for a cut file that ends after a whole record, as when its program was stopped.
  bool ends_behind_a_record() const { return end_ == End::kCut && position_ == record_at_; }

 private:
  std::optional<Message> stop(End end, std::string why);
  bool read_exactly(std::size_t size, Bytes& out);
  bool open();
  bool read_record();
  std::string damage_of_record();
  std::string damage_of_header() const;
  std::string damage_of_index() const;
  std::string damage_of_footer();
  bool is_sum_of_summary_right(std::uint32_t sum) const;
  bool read_data_record(Op op, std::span<const std::uint8_t> content);
  bool read_schema(std::span<const std::uint8_t> content);
  bool read_channel(std::span<const std::uint8_t> content);
  std::string damage_of_chunk(std::span<const std::uint8_t> content);
  std::optional<Message> next_in_chunk();
  std::optional<Message> message_of(std::span<const std::uint8_t> content);

  std::istream& in_;
  End end_ = End::kNotYet;
  std::string why_;
  bool is_open_ = false;
  std::uint64_t position_ = 0;  ///< bytes read so far
  std::uint64_t record_at_ = 0;
  std::uint64_t messages_ = 0, chunks_ = 0;
  bool follows_chunk_ = false;  ///< the previous record is a chunk or one of its indexes
  bool is_in_summary_ = false;  ///< DataEnd was read
  Op op_ = Op::kHeader;
  Bytes head_;  ///< type and length of the record
  Bytes content_;
  Bytes summary_;                ///< records after DataEnd, for their checksum
  std::optional<Bytes> counts_;  ///< content of the Statistics record
  Bytes chunk_;
  std::span<const std::uint8_t> rest_;  ///< unread part of the chunk
  std::map<std::uint16_t, Channel> schemas_;
  std::map<std::uint16_t, Channel> channels_;
};

}  // namespace tandem::recording
