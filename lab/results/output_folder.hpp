// Output folder of the lab's commands.
#pragma once

#include <filesystem>
#include <string>

namespace tandem::lab {

/// Creates the folder for `--out`. Fails: std::invalid_argument that names the folder and the reason.
std::filesystem::path made_folder(const std::string& out);

/// Writes `text` to `file`. Fails: std::runtime_error that names the file and the reason.
void write_text_file(const std::filesystem::path& file, const std::string& text);

}  // namespace tandem::lab
