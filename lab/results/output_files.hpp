// Writes results that took minutes to compute: either all files or none, even if the user presses Ctrl-C.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/html_report.hpp"

namespace tandem::lab {

/// Checks before the computation that the folder for `--out` can be created. Folders that the check creates are removed
/// again.
/// Fails   see made_folder()
void check_folder_can_be_made(const std::string& out);

/// Returns a word quoted such that a POSIX shell reads it back unchanged.
std::string shell_word(const std::string& word);

/// Adds report.html and its figures to the files with the results. The page states the command of this process, its
/// version, the date and the SHA-256 of each file.
std::map<std::string, std::string> with_report(std::map<std::string, std::string> files, HtmlReport report,
                                               const std::string& name = "report.html");

/// Creates the folder and writes all files, whose names may contain folders. Each file is first written under a
/// temporary name; then all are renamed. Therefore a reader finds either the previous files or the new ones, even after
/// an interruption. SIGINT and SIGTERM are blocked until the renaming ends.
///
/// Fails   see made_folder() and write_text_file(); or a folder exists under the name of a file. In the last case only
///         the files renamed before the failure remain
void write_all_files(const std::string& out, const std::map<std::string, std::string>& files);

}  // namespace tandem::lab
