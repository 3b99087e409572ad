// Reads all files of a recording that was split by size or age, as one sequence of messages.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/recording/mcap_reader.hpp"

namespace tandem::proto {

/// Result of reading a recording.
struct RecordingEnd {
  std::vector<std::filesystem::path> files;  ///< files that were read, in order
  bool is_whole = true;                      ///< true: each file was closed properly (it ends with its end record)
  /// True: messages are missing, because a file is damaged or ends within a record, or because a part does not exist. A
  /// file whose program was stopped ends between two records, and therefore does not count as damaged.
  bool is_damaged = false;
  /// Description of the damage: file, byte offset, kind, and number of messages before it; empty without damage.
  std::string why;
};

/// Function that is called for each message. It returns false to stop the reading.
using OnMessage = std::function<bool(const std::string& topic, const recording::Message& message)>;

/// Reads `first` and the following files of its recording in the same folder: "attic.mcap", "attic-002.mcap", …. Files
/// with such names that belong to a different recording are skipped. A truncated file is read as far as possible.
/// Fails   std::invalid_argument: `first` cannot be opened, or contains no message
RecordingEnd read_recording(const std::filesystem::path& first, const OnMessage& on_message);

}  // namespace tandem::proto
