// Folders of the user by the XDG Base Directory Specification, and a function by which file names survive a power loss.
#pragma once

#include <filesystem>

namespace tandem {

/// Returns the folder for programs of the user: that of the XDG variable, otherwise a folder below $HOME. A relative path
/// in the variable is ignored, as the specification requires.
/// In      xdg  variable, such as "XDG_CACHE_HOME"
///         below_home  folder below $HOME, such as ".cache"
/// Out     empty if neither variable is set
std::filesystem::path user_folder(const char* xdg, const std::filesystem::path& below_home);

/// Makes the names in a folder survive a power loss, if the file system supports this.
void sync_folder(const std::filesystem::path& folder);

}  // namespace tandem
