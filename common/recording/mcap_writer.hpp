// Converts messages to the bytes of an MCAP file, append-only: bytes once returned do not change.
//
//   magic, Header, Schema and Channel records   begin()
//   Chunk of messages, a MessageIndex a channel  pop_chunk(), each time
//   DataEnd, summary, Footer, magic              finish()
//
// A file that ends after any chunk is readable up to there: schemas and channels precede all chunks.
#pragma once

#include <array>
#include <cstddef>
#include <map>

#include "common/recording/mcap.hpp"

namespace tandem::recording {

/// Writer of one file at a time.
///
/// Thread  one at a time
class McapWriter {
 public:
  /// In      library  name of the writing program
  McapWriter(std::vector<Channel> channels, std::string library);

  /// The beginning of a file; discards the state of the previous file.
  Bytes begin();
  /// Adds a message to the open chunk; at most 65,535 channels.
  void add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data);
  /// Bytes of the messages that wait for pop_chunk(), before compression.
  std::size_t waiting_bytes() const { return chunk_.size(); }
  std::uint64_t waiting_messages() const { return chunk_messages_; }
  /// The messages added since the last call, compressed; empty if there are none. Append the bytes at the end of the
  /// file: the index of finish() relies on this.
  Bytes pop_chunk();
  /// Undoes the last pop_chunk(), whose bytes could not be written.
  void drop_chunk();
  /// The end of the file.
  Bytes finish();

 private:
  using Index = std::map<std::uint16_t, std::vector<std::array<std::uint64_t, 2>>>;
  void describe_channels(Bytes& out) const;
  void add_statistics(Bytes& out) const;

  std::vector<Channel> channels_;
  std::string library_;
  std::uint64_t file_bytes_ = 0;
  Bytes chunk_;
  Index index_;  ///< times and offsets in the open chunk
  std::uint64_t chunk_messages_ = 0;
  std::vector<std::uint32_t> sequences_;
  Bytes chunk_indexes_;  ///< ChunkIndex records of the file
  std::vector<std::uint64_t> counts_;
  std::uint64_t chunks_ = 0, begin_ns_ = 0, end_ns_ = 0;
  // State before the last pop_chunk().
  std::size_t last_indexes_ = 0;
  std::uint64_t last_file_bytes_ = 0, last_begin_ns_ = 0, last_end_ns_ = 0;
  std::vector<std::uint64_t> last_counts_;
};

}  // namespace tandem::recording
