// Paths of files in the source tree that tests read: documents, scenes, golden values.
#pragma once

#include <filesystem>
#include <string_view>

namespace tandem::test {

/// Returns the absolute path of a file.
/// In      relative  path relative to the root of the source tree, e.g. "proto/WIRE.md"
std::filesystem::path source_path(std::string_view relative);

}  // namespace tandem::test
