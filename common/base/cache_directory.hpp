// Where programs keep what would take long to make or fetch again, and how it is written there.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>

namespace tandem {

/// $TANDEM_CACHE, else $XDG_CACHE_HOME/tandem, else $HOME/.cache/tandem; empty (no cache) when none is set.
std::filesystem::path default_cache_directory();

/// Writes the parts as one file, under another name first: who reads meanwhile sees all of it or nothing. Makes
/// the folder.
/// Out     false: it cannot be written, and nothing is left of it
/// Thread  any
bool write_whole_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts);

}  // namespace tandem
