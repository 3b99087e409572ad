// Folders of the programs: supplied data (scenes, experiments, hand paths, device profiles) and the cache. Also writes
// files atomically.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <system_error>

namespace tandem {

/// $TANDEM_DATA, else ../share/tandem beside the running program. This holds for built, installed and moved programs.
/// Out     e.g. /usr/share/tandem; need not exist
std::filesystem::path data_folder();

/// $TANDEM_CACHE, else $XDG_CACHE_HOME/tandem, else $HOME/.cache/tandem; empty (no cache) when none is set.
std::filesystem::path default_cache_directory();

/// Writes the parts as one file, first under another name. A reader sees all of it or nothing, also after a power loss.
/// Creates the folder.
/// In      mode  file permission bits, see chmod(2)
/// Out     the error, if any; then the previous file is unchanged and no partial file is left
/// Thread  any
std::error_code replace_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts,
                             unsigned mode = 0644);

/// Writes a file that can be made or fetched again, like replace_file(). Does not wait for the disk, so an io thread
/// may call it. After a power loss the file may be incomplete; its readers must detect this.
std::error_code replace_cache_file(const std::filesystem::path& file,
                                   std::initializer_list<std::span<const std::byte>> parts);

/// Removes partial files that killed writers left beside `file`. Call it only if no other process writes the file: a
/// partial file in use looks the same.
/// Out     number of files removed
/// Thread  any
std::size_t remove_unfinished(const std::filesystem::path& file);

/// Writes a new file, like replace_file(). Returns file_exists and changes nothing if the file exists, also if another
/// process creates it at the same time.
std::error_code write_new_file(const std::filesystem::path& file,
                               std::initializer_list<std::span<const std::byte>> parts, unsigned mode = 0644);

}  // namespace tandem
