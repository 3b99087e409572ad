// Writes results that took minutes to compute: either all files or none, even if the user presses Ctrl-C.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "lab/report/html_report.hpp"

namespace tandem::lab {

/// Checks before a long computation that the folder for `--out` can be created. The check creates the missing folders
/// and removes them again.
/// Fails   see made_folder()
void check_folder_can_be_made(const std::string& out);

/// Returns a word quoted such that a POSIX shell reads it back unchanged.
std::string shell_word(const std::string& word);

/// Adds report.html and its figures to the files with the results. The page states the command of this process, its
/// version, the date and the SHA-256 of each file.
std::map<std::string, std::string> with_report(std::map<std::string, std::string> files, HtmlReport report,
                                               const std::string& name = "report.html");

/// Creates the folder and writes all files. The names of the files may contain folders. All files are first written
/// under temporary names and then renamed. SIGINT and SIGTERM are blocked during the renaming. Therefore an
/// interruption leaves either all previous files or all new ones.
///
/// Fails   see made_folder() and write_text_file(). std::runtime_error: a folder already has the name of a file.
///         std::filesystem::filesystem_error: a file cannot be renamed; the files renamed before it remain
void write_all_files(const std::string& out, const std::map<std::string, std::string>& files);

}  // namespace tandem::lab
