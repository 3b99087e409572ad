// Writes a recording to disk as MCAP files that rotate by size and age, and continues when a full disk has space again.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>

#include "common/base/time.hpp"
#include "common/recording/mcap_writer.hpp"

namespace tandem::recording {

struct RotationSettings {
  std::uint64_t max_bytes = std::uint64_t{1} << 30U;  ///< size at which the next file begins; 0: never
  Duration max_age{std::chrono::hours(1)};            ///< age at which the next file begins; 0: never
};

/// Writes a recording in parts. The parts of "attic.mcap" are named "attic.mcap", "attic-002.mcap", …. Numbers of
/// existing files are skipped, so that nothing is overwritten.
///
/// Thread  any, one at a time; may block on the disk
class RecordingFile {
 public:
  /// Function that returns a description of the recording. The description is the first message of each part, on
  /// channel 0, so that a part is readable without the other parts.
  using Describe = std::function<Bytes(std::uint32_t part)>;

  /// Creates the first part.
  /// Fails   std::invalid_argument: the file cannot be created, or already exists
  RecordingFile(std::filesystem::path file, McapWriter writer, RotationSettings rotation, Describe describe);
  /// Calls finish().
  ~RecordingFile();
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;

  void add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data);
  /// Writes all added messages to the file, and begins the next part when it is due. Written messages survive a
  /// SIGKILL. If a write fails, for example on a full disk, its messages are lost and counted. The next flush writes
  /// only messages added since.
  void flush(std::uint64_t now_ns);
  /// Writes the end of the file. May be called repeatedly.
  void finish();

  const std::filesystem::path& path() const { return path_; }
  // Any thread may call the next three functions.
  std::uint64_t messages_written() const { return messages_written_.load(std::memory_order_relaxed); }
  std::uint64_t messages_lost() const { return messages_lost_.load(std::memory_order_relaxed); }
  std::uint64_t bytes_written() const { return bytes_written_.load(std::memory_order_relaxed); }
  // Call the next two functions from one thread at a time, which must not run add() or flush() at the same time.
  std::uint32_t parts() const { return part_; }
  /// Returns a message for the user if the state has changed since the last call: writing has begun to fail, or has
  /// succeeded again for 5 s. Otherwise returns an empty text.
  std::string pop_news();

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
  std::uint32_t part_ = 0;         ///< number of the part, from 1
  std::uint32_t file_number_ = 0;  ///< number in the file name, from 1; numbers of existing files are skipped
  bool is_described_ = false;      ///< the description of this part was written to the file
  bool is_described_in_chunk_ = false;
  bool is_finished_ = false;
  std::uint64_t size_ = 0;  ///< size of this part, not including failed writes
  std::uint64_t begun_ns_ = 0;
  std::atomic<std::uint64_t> bytes_written_{0}, messages_written_{0}, messages_lost_{0};
  bool is_failing_ = false;      ///< true: the last report to the user (pop_news) was a failed write
  std::uint64_t failed_ns_ = 0;  ///< time of the last failed write
  std::string news_;
};

}  // namespace tandem::recording
