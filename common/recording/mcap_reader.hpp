// The messages of an MCAP file, in the order in which they were written. The bytes are trusted in nothing: what is longer than
// the limits, or does not fit together, ends the reading there.
#pragma once

#include <istream>
#include <map>
#include <optional>

#include "common/recording/mcap.hpp"

namespace tandem::recording {

/// Reads records one after the other, without the index: so a file that ends anywhere is read to its last whole chunk.
///
/// Limits  a record and an unpacked chunk of 64 MiB, 1024 channels; chunks as they are or of zstd; no attachments
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

 private:
  std::optional<Message> stop(End end, std::string why);
  bool read_exactly(std::size_t size, Bytes& out);
  bool open();
  bool read_record();
  bool take_record(Op op, std::span<const std::uint8_t> content);
  bool take_schema(std::span<const std::uint8_t> content);
  bool take_channel(std::span<const std::uint8_t> content);
  bool open_chunk(std::span<const std::uint8_t> content);
  std::optional<Message> next_in_chunk();
  std::optional<Message> message_of(std::span<const std::uint8_t> content);

  std::istream& in_;
  End end_ = End::kNotYet;
  std::string why_;
  bool is_open_ = false;
  Op op_ = Op::kHeader;
  Bytes content_;
  Bytes chunk_;
  std::span<const std::uint8_t> rest_;  ///< of the chunk
  std::map<std::uint16_t, Channel> schemas_;
  std::map<std::uint16_t, Channel> channels_;
};

}  // namespace tandem::recording
