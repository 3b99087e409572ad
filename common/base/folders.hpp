// Two kinds of functions:
// * folders of the programs: installed data (scenes, experiments, hand paths, device profiles) and the cache
// * writing of files atomically
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <system_error>

namespace tandem {

/// Returns the folder of this project's programs. If this code is part of libtandem.so, this is ../bin relative to that
/// library, otherwise the folder of the running program. The relative path is the same in a build tree and in an
/// installation, and it remains valid when the installation is moved.
/// Out     empty if the folder cannot be determined
std::filesystem::path program_folder();

/// Returns $TANDEM_DATA if it is set, otherwise ../share/tandem relative to program_folder().
/// Out     e.g. /usr/share/tandem; the folder need not exist
std::filesystem::path data_folder();

/// Returns a folder of the user according to the XDG Base Directory Specification: the value of the variable `xdg`, or
/// else $HOME/below_home. A relative path in the variable is ignored, as the specification requires.
/// In      xdg         name of the variable, such as "XDG_CACHE_HOME"
///         below_home  folder relative to $HOME, such as ".cache"
/// Out     empty if neither `xdg` (with an absolute path) nor HOME is set
std::filesystem::path user_folder(const char* xdg, const std::filesystem::path& below_home);

/// Writes the file names of a folder to the disk, so that they survive a power loss. Has no effect if the file system
/// does not support this.
void sync_folder(const std::filesystem::path& folder);

/// Returns the cache folder: the first of $TANDEM_CACHE, $XDG_CACHE_HOME/tandem and $HOME/.cache/tandem whose variable
/// is set. If none is set, returns an empty path, and no cache is used.
std::filesystem::path default_cache_directory();

/// Writes a file that consists of the given parts. It is written under a temporary name and then renamed. A reader
/// therefore sees the complete new file or the previous one, even after a power loss. Creates the folder if necessary.
/// In      mode  file permission bits, see chmod(2)
/// Out     the error, if any; in that case the previous file is unchanged and no partial file is left
/// Thread  any
std::error_code replace_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts,
                             unsigned mode = 0644);

/// Writes a file that can be computed or downloaded again. Unlike replace_file(), this function does not wait for the
/// disk, so an io thread may call it. After a power loss the file may be incomplete, which its readers must detect.
std::error_code replace_cache_file(const std::filesystem::path& file,
                                   std::initializer_list<std::span<const std::byte>> parts);

/// Removes temporary files in the folder of `file` that terminated writers left behind. Call it only if no other
/// process writes `file`, because the temporary file of a running writer has the same name pattern.
/// Out     number of files removed
/// Thread  any
std::size_t remove_unfinished(const std::filesystem::path& file);

/// Writes a new file atomically, like replace_file(). If the file exists, or another process creates it at the same
/// time, returns file_exists and changes nothing.
std::error_code write_new_file(const std::filesystem::path& file,
                               std::initializer_list<std::span<const std::byte>> parts, unsigned mode = 0644);

}  // namespace tandem
