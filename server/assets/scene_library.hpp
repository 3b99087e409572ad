// Finds scene files by name, so that an operator need not know where they are installed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem::server {

/// Folders searched for NAME.json: the one of the scenes that come with Tandem.
std::vector<std::filesystem::path> scene_folders();

/// `name_or_file` when it is a file; else NAME.json in the first folder that has it.
/// Fails   SceneError that names what was looked for and the scenes that exist
std::filesystem::path find_scene(const std::string& name_or_file, const std::vector<std::filesystem::path>& folders);

}  // namespace tandem::server
