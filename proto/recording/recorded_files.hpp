// Reads the files of a rotated recording as one.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/recording/mcap_reader.hpp"

namespace tandem::proto {

/// Extent of a recording.
struct RecordingEnd {
  std::vector<std::filesystem::path> files;  ///< files that were read
  bool is_whole = true;                      ///< each file has its end record
  /// Written messages are missing: a file is damaged or cut within a record, or a part is missing. The file of a
  /// stopped program is not whole, but not damaged.
  bool is_damaged = false;
  /// File, byte offset and kind of the damage, and the amount read until there; empty: none.
  std::string why;
};

/// Returns false to stop reading.
using OnMessage = std::function<bool(const std::string& topic, const recording::Message& message)>;

/// Reads `first` and the following files beside it: "attic.mcap", "attic-002.mcap", … Files of other recordings between
/// them are skipped. A truncated file is read to its end.
/// Fails   std::invalid_argument: `first` cannot be opened, or has no message
RecordingEnd read_recording(const std::filesystem::path& first, const OnMessage& on_message);

}  // namespace tandem::proto
