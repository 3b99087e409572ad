// A recording on disk: MCAP files that rotate by size and age, on a disk that may be full.
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

/// The parts of "attic.mcap" are "attic.mcap", "attic-002.mcap", …; numbers of existing files are skipped, so that
/// nothing is overwritten.
///
/// Thread  one at a time; may block on the disk
class RecordingFile {
 public:
  /// First message of each part, on channel 0, so that each part is readable alone.
  using Describe = std::function<Bytes(std::uint32_t part)>;

  /// Creates the first part.
  /// Fails   std::invalid_argument: the file cannot be created, or exists already
  RecordingFile(std::filesystem::path file, McapWriter writer, RotationSettings rotation, Describe describe);
  /// Calls finish().
  ~RecordingFile();
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;

  void add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data);
  /// Writes all added messages to the file, where they survive kill −9, and begins the next part when due. Messages
  /// that the disk refuses are lost and counted; the next flush tries again.
  void flush(std::uint64_t now_ns);
  /// Writes the end of the file. Idempotent.
  void finish();

  const std::filesystem::path& path() const { return path_; }
  // Thread  any
  std::uint64_t messages_written() const { return messages_written_.load(std::memory_order_relaxed); }
  std::uint64_t messages_lost() const { return messages_lost_.load(std::memory_order_relaxed); }
  std::uint64_t bytes_written() const { return bytes_written_.load(std::memory_order_relaxed); }
  // Thread  the thread of the calls above
  std::uint32_t parts() const { return part_; }
  /// Message to the user since the last call: the disk refuses data, or has accepted everything for 5 s again; empty if
  /// there is none.
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
  std::uint32_t file_number_ = 0;  ///< number in the file name, from 1; existing files count
  bool is_described_ = false;      ///< the description of this part is in the file
  bool is_described_in_chunk_ = false;
  bool is_finished_ = false;
  std::uint64_t size_ = 0;  ///< size of this part without failed writes
  std::uint64_t begun_ns_ = 0;
  std::atomic<std::uint64_t> bytes_written_{0}, messages_written_{0}, messages_lost_{0};
  bool is_failing_ = false;      ///< state last reported to the user
  std::uint64_t failed_ns_ = 0;  ///< time of the last failure
  std::string news_;
};

}  // namespace tandem::recording
