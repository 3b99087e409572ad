// Finds scene files by name, so an operator does not need their installation folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem::server {

/// Folders that are searched for NAME.json: the folder of the scenes that are part of Tandem.
std::vector<std::filesystem::path> scene_folders();

/// Returns `name_or_file` if it is a file, else NAME.json in the first folder that contains it.
/// Fails   SceneError that names the requested scene and the scenes that exist
std::filesystem::path find_scene(const std::string& name_or_file, const std::vector<std::filesystem::path>& folders);

}  // namespace tandem::server
