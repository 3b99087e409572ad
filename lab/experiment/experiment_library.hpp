// Finds experiment files by name, independent of the place of installation.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tandem::lab {

/// Folder of the shipped experiments.
/// Fails   std::invalid_argument naming the folder that was searched
std::filesystem::path shipped_experiments();

/// Files for the names: a file itself, or NAME.json of the shipped ones; without names all shipped ones, sorted.
/// Fails   std::invalid_argument: there is no such experiment (lists the shipped ones)
std::vector<std::filesystem::path> experiment_files(std::span<const std::string> names);

}  // namespace tandem::lab
