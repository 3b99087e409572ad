// Reads the messages of an MCAP file in the order in which they were written. The file is not trusted: reading ends at
// the first record that exceeds the limits, has a wrong checksum or contradicts earlier records. offset() then returns
// the position of that record.
#pragma once

#include <istream>
#include <map>
#include <optional>

#include "common/recording/mcap.hpp"

namespace tandem::recording {

/// Reads records sequentially, without the index. A truncated file is therefore readable up to its last complete chunk.
///
/// Limits  64 MiB for a record and for an uncompressed chunk, 1024 channels. Messages must be in chunks with a
///         checksum, uncompressed or compressed by zstd. Attachments are not supported
/// Thread  any, one at a time
class McapReader {
 public:
  /// State of reading:
  /// kNotYet   reading has not ended
  /// kWhole    the end of a complete file was reached
  /// kCut      the file is truncated
  /// kDamaged  the file is damaged
  enum class End : std::uint8_t { kNotYet, kWhole, kCut, kDamaged };

  /// In      in  binary stream positioned at the start of the file; must outlive the reader
  explicit McapReader(std::istream& in);

  /// Returns the next message, whose data remain valid until the next call. Returns nothing when reading has ended; the
  /// cause is then available from end().
  std::optional<Message> next();
  /// Returns the channel with this id; null if the file has had no record of this channel so far.
  const Channel* channel(std::uint16_t id) const;
  End end() const { return end_; }
  /// Returns the readable reason why reading ended; empty if the file is complete.
  const std::string& why() const { return why_; }
  /// Returns the file offset of the last record read. For a truncated or damaged file this is the record at which
  /// reading stopped.
  std::uint64_t offset() const { return record_at_; }
  /// Returns the number of messages that next() has returned.
  std::uint64_t messages() const { return messages_; }
  /// Returns true for a truncated file that ends after a complete record. Such a file arises when the writing program
  /// is stopped.
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
  bool follows_chunk_ = false;  ///< true: the previous record was a chunk or one of its MessageIndex records
  bool is_in_summary_ = false;  ///< true: the record DataEnd, which precedes the summary, was read
  Op op_ = Op::kHeader;
  Bytes head_;  ///< type and length of the current record
  Bytes content_;
  Bytes summary_;                ///< all records after DataEnd, kept to verify their checksum
  std::optional<Bytes> counts_;  ///< content of the Statistics record
  Bytes chunk_;
  std::span<const std::uint8_t> rest_;  ///< part of the chunk that is not read yet
  std::map<std::uint16_t, Channel> schemas_;
  std::map<std::uint16_t, Channel> channels_;
};

}  // namespace tandem::recording
