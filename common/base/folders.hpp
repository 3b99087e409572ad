// Folders of the programs: of what comes with Tandem (scenes, experiments, hand paths, device profiles), and of what
// would take long to make or fetch again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>

namespace tandem {

/// $TANDEM_DATA, else ../share/tandem beside the running program, whether that was built or installed, and wherever
/// its folders were moved to.
/// Out     e.g. /usr/share/tandem; need not exist
std::filesystem::path data_folder();

/// $TANDEM_CACHE, else $XDG_CACHE_HOME/tandem, else $HOME/.cache/tandem; empty (no cache) when none is set.
std::filesystem::path default_cache_directory();

/// Writes the parts as one file, under another name first: who reads meanwhile sees all of it or nothing. Makes
/// the folder.
/// Out     false: it cannot be written, and nothing is left of it
/// Thread  any
bool write_whole_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts);

}  // namespace tandem
