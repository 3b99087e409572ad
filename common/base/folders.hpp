// Folders of the programs: of what comes with Tandem (scenes, experiments, hand paths, device profiles), and of what
// would take long to make or fetch again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <system_error>

namespace tandem {

/// $TANDEM_DATA, else ../share/tandem beside the running program, whether that was built or installed, and wherever
/// its folders were moved to.
/// Out     e.g. /usr/share/tandem; need not exist
std::filesystem::path data_folder();

/// $TANDEM_CACHE, else $XDG_CACHE_HOME/tandem, else $HOME/.cache/tandem; empty (no cache) when none is set.
std::filesystem::path default_cache_directory();

/// Writes the parts as one file, under another name first: who reads meanwhile, or after a loss of power, sees all of
/// it or nothing. Makes the folder.
/// mode    of the file, as in chmod(2)
/// Out     what stood in the way; then nothing is left of it, and what stood there before stands
/// Thread  any
std::error_code replace_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts,
                             unsigned mode = 0644);

/// Likewise, of what can be made or fetched again: does not wait for the disk, so that io may call it. After a loss of
/// power it may be there in part, and who reads it must notice.
std::error_code replace_cache_file(const std::filesystem::path& file,
                                   std::initializer_list<std::span<const std::byte>> parts);

/// Removes what writers left beside the file that were killed while they wrote it. Only for who alone writes it: whether
/// another one still writes cannot be told.
/// Out     how many there were
/// Thread  any
std::size_t remove_unfinished(const std::filesystem::path& file);

/// As replace_file(); file_exists where the file is there already, and stays as it is, also when another process makes it at the
/// same time.
std::error_code write_new_file(const std::filesystem::path& file,
                               std::initializer_list<std::span<const std::byte>> parts, unsigned mode = 0644);

}  // namespace tandem
