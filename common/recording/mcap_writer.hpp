// Messages to the bytes of an MCAP file, append-only: what has been taken stays as it is.
//
//   magic, Header, Schema and Channel records   begin()
//   Chunk of messages, a MessageIndex a channel  take_chunk(), each time
//   DataEnd, summary, Footer, magic              finish()
//
// A file that ends behind any chunk can be read to there: schemas and channels stand before all chunks.
#pragma once

#include <array>
#include <cstddef>
#include <map>

#include "common/recording/mcap.hpp"

namespace tandem::recording {

/// Thread  one at a time
class McapWriter {
 public:
  /// In      library  which program writes
  McapWriter(std::vector<Channel> channels, std::string library);

  /// The beginning of a file; forgets what was written of another.
  Bytes begin();
  /// Adds a message to the chunk that is open; at most 65,535 channels.
  void add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data);
  /// Of messages that wait for take_chunk(), before compression.
  std::size_t waiting_bytes() const { return chunk_.size(); }
  std::uint64_t waiting_messages() const { return chunk_messages_; }
  /// What was added since the last call, compressed; empty: nothing was. It must be written where the file ends: the
  /// index that finish() makes says so.
  Bytes take_chunk();
  /// The chunk of the last take_chunk() did not get into the file: as if it had not been.
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
  Index index_;  ///< of the open chunk: time, and where in it
  std::uint64_t chunk_messages_ = 0;
  std::vector<std::uint32_t> sequences_;
  Bytes chunk_indexes_;  ///< records
  std::vector<std::uint64_t> counts_;
  std::uint64_t chunks_ = 0, begin_ns_ = 0, end_ns_ = 0;
  // Before the last take_chunk().
  std::size_t last_indexes_ = 0;
  std::uint64_t last_file_bytes_ = 0, last_begin_ns_ = 0, last_end_ns_ = 0;
  std::vector<std::uint64_t> last_counts_;
};

}  // namespace tandem::recording
