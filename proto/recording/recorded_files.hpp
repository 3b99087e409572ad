// Reads all files of a rotated recording as one sequence of messages.
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
  bool is_whole = true;                      ///< each file ends with its end record
  /// Written messages are missing: a file is damaged or truncated within a record, or a part is missing. If the program
  /// was stopped, its file is incomplete but not damaged.
  bool is_damaged = false;
  /// File, byte offset and kind of the damage, and the number of messages read before it; empty if there is none.
  std::string why;
};

/// Function called for each message; it returns false to stop reading.
using OnMessage = std::function<bool(const std::string& topic, const recording::Message& message)>;

/// Reads `first` and the files that follow it in the same folder: "attic.mcap", "attic-002.mcap", …. Files of other
/// recordings among them are skipped. A truncated file is read as far as possible.
/// Fails   std::invalid_argument: `first` cannot be opened, or contains no message
RecordingEnd read_recording(const std::filesystem::path& first, const OnMessage& on_message);

}  // namespace tandem::proto
