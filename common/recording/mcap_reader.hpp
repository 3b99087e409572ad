// The messages of an MCAP file, in the order in which they were written. The bytes are trusted in nothing: a record that is
// longer than the limits, has a wrong sum or does not fit the others ends the reading there, and is named with its place.
#pragma once

#include <istream>
#include <map>
#include <optional>

#include "common/recording/mcap.hpp"

namespace tandem::recording {

/// Reads records one after the other, without the index: so a file that ends anywhere is read to its last whole chunk.
///
/// Limits  a record and an unpacked chunk of 64 MiB, 1024 channels; messages in chunks with a sum, as they are or of zstd;
///         no attachments
/// Thread  one at a time
class McapReader {
 public:
  /// How a file ended.
  enum class End : std::uint8_t { kNotYet, kWhole, kCut, kDamaged };

  /// In      in  binary, from its start; outlives this
  explicit McapReader(std::istream& in);

  /// The next message; nothing: there is no more, see end(). Its data stay until the next call.
  std::optional<Message> next();
  /// Channels are those that came so far, by the number that messages have; null: there is none of it.
  const Channel* channel(std::uint16_t id) const;
  End end() const { return end_; }
  /// For people: what ended the reading; empty of a whole file.
  const std::string& why() const { return why_; }
  /// Bytes of the file before the record that was read last: where it is cut or damaged.
  std::uint64_t offset() const { return record_at_; }
  /// That next() returned.
  std::uint64_t messages() const { return messages_; }
  /// A file that is cut ends behind a whole record, as that of a program that was stopped.
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
  bool take_record(Op op, std::span<const std::uint8_t> content);
  bool take_schema(std::span<const std::uint8_t> content);
  bool take_channel(std::span<const std::uint8_t> content);
  std::string damage_of_chunk(std::span<const std::uint8_t> content);
  std::optional<Message> next_in_chunk();
  std::optional<Message> message_of(std::span<const std::uint8_t> content);

  std::istream& in_;
  End end_ = End::kNotYet;
  std::string why_;
  bool is_open_ = false;
  std::uint64_t position_ = 0;  ///< bytes that were read
  std::uint64_t record_at_ = 0;
  std::uint64_t messages_ = 0, chunks_ = 0;
  bool follows_chunk_ = false;  ///< the record before is a chunk or one of its indexes
  bool is_in_summary_ = false;  ///< DataEnd has come
  Op op_ = Op::kHeader;
  Bytes head_;  ///< of the record: its kind and length
  Bytes content_;
  Bytes summary_;                ///< records behind DataEnd, for their sum
  std::optional<Bytes> counts_;  ///< the content of Statistics
  Bytes chunk_;
  std::span<const std::uint8_t> rest_;  ///< of the chunk
  std::map<std::uint16_t, Channel> schemas_;
  std::map<std::uint16_t, Channel> channels_;
};

}  // namespace tandem::recording
