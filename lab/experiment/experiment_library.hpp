// Finds experiment files by name, wherever the program is installed.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tandem::lab {

/// Returns the folder of the shipped experiments.
/// Fails   std::invalid_argument naming the folder that was searched
std::filesystem::path shipped_experiments();

/// Returns the file for each name. A name is a path to a file, or NAME of a shipped experiment NAME.json. Without
/// names, all shipped experiments are returned, sorted.
/// Fails   std::invalid_argument: an experiment does not exist; the message lists the shipped ones
std::vector<std::filesystem::path> experiment_files(std::span<const std::string> names);

}  // namespace tandem::lab
