// Writes results of minutes of work: all files or none, even if the user presses Ctrl-C.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace tandem::lab {

/// Checks before the work whether the folder of `--out` can be made. Removes the folders that it made.
/// Fails   like made_folder()
void check_folder_can_be_made(const std::string& out);

/// Makes the folder and writes all files. Each is written under another name first, then all are renamed. So readers,
/// also after an interruption, find either the previous files or these. SIGINT and SIGTERM are blocked meanwhile.
///
/// Fails   like made_folder() and write_text_file(), or if a folder has the name of a file. Only files that had already
///         been renamed remain
void write_all_files(const std::string& out, const std::map<std::string, std::string>& files);

}  // namespace tandem::lab
