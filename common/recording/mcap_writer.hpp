// Converts messages to the bytes of an MCAP file. Bytes that were returned once never change, so the caller only needs
// to append to the file.
//
//   magic, Header, Schema and Channel records        begin()
//   Chunk of messages, one MessageIndex per channel  each pop_chunk()
//   DataEnd, summary, Footer, magic                  finish()
//
// Schemas and channels precede all chunks. A file that is truncated is therefore readable up to its last complete
// chunk.
#pragma once

#include <array>
#include <cstddef>
#include <map>

#include "common/recording/mcap.hpp"

namespace tandem::recording {

/// Writes one or more files, one after the other.
///
/// Thread  any, one at a time
class McapWriter {
 public:
  /// In      library  name of the writing program, stored in the file
  McapWriter(std::vector<Channel> channels, std::string library);

  /// Returns the first bytes of a new file; discards the state of the previous file.
  Bytes begin();
  /// Adds a message to the current chunk; at most 65,535 channels are possible.
  void add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data);
  /// Returns the size of the messages added since the last pop_chunk(), before compression.
  std::size_t waiting_bytes() const { return chunk_.size(); }
  std::uint64_t waiting_messages() const { return chunk_messages_; }
  /// Returns the messages added since the last call as a compressed chunk; empty if there are none. The caller must
  /// append these bytes, and nothing else, to the file, because the index of finish() contains the position of each
  /// chunk.
  Bytes pop_chunk();
  /// Declares that the bytes of the last pop_chunk() could not be written: they are not counted as part of the file,
  /// and their messages are lost.
  void drop_chunk();
  /// Returns the last bytes of the file.
  Bytes finish();

 private:
  using Index = std::map<std::uint16_t, std::vector<std::array<std::uint64_t, 2>>>;
  void describe_channels(Bytes& out) const;
  void add_statistics(Bytes& out) const;

  std::vector<Channel> channels_;
  std::string library_;
  std::uint64_t file_bytes_ = 0;
  Bytes chunk_;
  Index index_;  ///< times and offsets of the messages in the current chunk
  std::uint64_t chunk_messages_ = 0;
  std::vector<std::uint32_t> sequences_;
  Bytes chunk_indexes_;  ///< ChunkIndex records of this file
  std::vector<std::uint64_t> counts_;
  std::uint64_t chunks_ = 0, begin_ns_ = 0, end_ns_ = 0;
  // Copies of the state before the last pop_chunk(), for drop_chunk().
  std::size_t last_indexes_ = 0;
  std::uint64_t last_file_bytes_ = 0, last_begin_ns_ = 0, last_end_ns_ = 0;
  std::vector<std::uint64_t> last_counts_;
};

}  // namespace tandem::recording
