// A recording that may have rotated, read as one.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/recording/mcap_reader.hpp"

namespace tandem::proto {

/// How far a recording goes.
struct RecordingEnd {
  std::vector<std::filesystem::path> files;  ///< that were read
  bool is_whole = true;                      ///< each had its end
  /// Messages are missing that were written: a file is damaged or cut within a record, or a part is missing. A file of a
  /// program that was stopped is not whole, but not damaged.
  bool is_damaged = false;
  /// What is damaged, at which byte, and what was read until there, with the file's name; empty: nothing.
  std::string why;
};

/// False: enough was read.
using OnMessage = std::function<bool(const std::string& topic, const recording::Message& message)>;

/// Reads `first` and, where they stand beside it, those that follow: "attic.mcap", "attic-002.mcap", … Files of other
/// recordings between them are skipped. A file that ends anywhere is read to there.
/// Fails   std::invalid_argument: `first` cannot be opened, or has no message
RecordingEnd read_recording(const std::filesystem::path& first, const OnMessage& on_message);

}  // namespace tandem::proto
