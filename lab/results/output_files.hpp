// Results of minutes of work: all files or none, also when somebody presses Ctrl-C.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace tandem::lab {

/// To be asked before the work: whether the folder that `--out` names can be made. Leaves nothing that was not there.
/// Fails   as made_folder()
void check_folder_can_be_made(const std::string& out);

/// Makes the folder and writes all files: each under another name first, then all are renamed, so that readers and
/// whoever interrupts find the files of before or these. SIGINT and SIGTERM wait meanwhile.
///
/// Fails   as made_folder() and write_text_file(), or when a folder is where a file shall be; nothing of it is left but
///         the files that had already been renamed
void write_all_files(const std::string& out, const std::map<std::string, std::string>& files);

}  // namespace tandem::lab
