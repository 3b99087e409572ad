// Delay paths: the delay of a link as a function of time, loaded by name.
#pragma once

#include <filesystem>
#include <string>

#include "common/net/link.hpp"

namespace tandem::lab {

/// Loads a delay path: either a file, relative to `directory`, or a shipped path by its name ("wifi"). An empty name
/// gives an empty path. The file contains the lists `times_s` and `delays_ms` of equal length, and optionally
/// `starts_anywhere` and `description`.
/// Fails   std::invalid_argument: its message names the file, the field and the remedy, or lists the shipped names
net::DelayPath delay_path_called(const std::string& name, const std::filesystem::path& directory);

}  // namespace tandem::lab
