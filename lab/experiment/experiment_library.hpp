// Finds experiment files by name, so that nobody need know where they are installed.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tandem::lab {

/// The folder of the shipped experiments.
/// Fails   std::invalid_argument naming where they are not
std::filesystem::path shipped_experiments();

/// A file for each name: the file itself, or NAME.json of the shipped ones; without a name all shipped ones, sorted.
/// Fails   std::invalid_argument: there is no such experiment (lists the shipped)
std::vector<std::filesystem::path> experiment_files(std::span<const std::string> names);

}  // namespace tandem::lab
