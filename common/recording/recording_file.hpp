// A recording on disk: MCAP files that follow each other as size and age say, on a disk that may be full.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>

#include "common/base/time.hpp"
#include "common/recording/mcap_writer.hpp"

namespace tandem::recording {

struct RotationSettings {
  std::uint64_t max_bytes = std::uint64_t{1} << 30U;  ///< a file that is larger is followed by another; 0: never
  Duration max_age{std::chrono::hours(1)};            ///< likewise; 0: never
};

/// Of an "attic.mcap" the parts are "attic.mcap", "attic-002.mcap", …; a number that is there already is left out, so nothing is
/// overwritten.
///
/// Thread  one at a time; may block on the disk
class RecordingFile {
 public:
  /// What a part begins with, as the first message of channel 0, so that each can be read alone.
  using Describe = std::function<Bytes(std::uint32_t part)>;

  /// Makes the first part.
  /// Fails   std::invalid_argument: it cannot be made, or is there already
  RecordingFile(std::filesystem::path file, McapWriter writer, RotationSettings rotation, Describe describe);
  /// As finish().
  ~RecordingFile();
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;

  void add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data);
  /// Everything added so far is in the file, where kill −9 leaves it, and the next part begins where it is due. What the
  /// disk does not take is lost and counted; the next flush tries again.
  void flush(std::uint64_t now_ns);
  /// Writes the end. Idempotent.
  void finish();

  const std::filesystem::path& path() const { return path_; }
  // Thread  any
  std::uint64_t messages_written() const { return messages_written_.load(std::memory_order_relaxed); }
  std::uint64_t messages_lost() const { return messages_lost_.load(std::memory_order_relaxed); }
  std::uint64_t bytes_written() const { return bytes_written_.load(std::memory_order_relaxed); }
  // Thread  that of the calls above
  std::uint32_t parts() const { return part_; }
  /// What a person should be told since the last call: the disk takes no more, or has taken everything for 5 s again; empty:
  /// nothing.
  std::string take_news();

 private:
  void open(std::uint64_t now_ns);
  bool append(std::span<const std::uint8_t> bytes);
  bool open_new_file();
  bool is_due(std::uint64_t now_ns) const;
  void close();

  std::filesystem::path first_;
  std::filesystem::path path_;
  McapWriter writer_;
  RotationSettings rotation_;
  Describe describe_;
  int descriptor_ = -1;
  std::uint32_t part_ = 0;         ///< 1: the first
  std::uint32_t file_number_ = 0;  ///< likewise, and counts those that were there already
  bool is_described_ = false;      ///< this part, in the file
  bool is_described_in_chunk_ = false;
  bool is_finished_ = false;
  std::uint64_t size_ = 0;  ///< of this part, as far as it is good
  std::uint64_t begun_ns_ = 0;
  std::atomic<std::uint64_t> bytes_written_{0}, messages_written_{0}, messages_lost_{0};
  bool is_failing_ = false;      ///< as a person was told
  std::uint64_t failed_ns_ = 0;  ///< the last time
  std::string news_;
};

}  // namespace tandem::recording
