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
  bool is_whole = true;                      ///< true: each file ends with its end record
  /// Whether written messages are missing: a file is damaged or truncated within a record, or a part is missing. A file
  /// of a stopped program is incomplete but does not count as damaged.
  bool is_damaged = false;
  /// File, byte offset and kind of the damage, and the number of messages before it; empty without damage.
  std::string why;
};

/// Called for each message; returns false to stop reading.
using OnMessage = std::function<bool(const std::string& topic, const recording::Message& message)>;

/// Reads `first` and its following files in the same folder: "attic.mcap", "attic-002.mcap", …. Files among them that
/// belong to a different recording are skipped. A truncated file is read as far as possible.
/// Fails   std::invalid_argument: `first` cannot be opened, or contains no message
RecordingEnd read_recording(const std::filesystem::path& first, const OnMessage& on_message);

}  // namespace tandem::proto
