// Delay paths by name: the delay of a link as a function of time.
#pragma once

#include <filesystem>
#include <string>

#include "common/net/link.hpp"

namespace tandem::lab {

/// Loads a delay path from a file, relative to `directory`, or a shipped one by name ("wifi"); "": none. The file has
/// `times_s` and `delays_ms`, lists of the same length, and may have `starts_anywhere` and `description`.
/// Fails   std::invalid_argument naming file, field and remedy, or the shipped names
net::DelayPath delay_path_called(const std::string& name, const std::filesystem::path& directory);

}  // namespace tandem::lab
