// Finds scene files by name, so that operators need not know the installation folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem::server {

/// Returns the folders in which NAME.json is searched for; at present only the folder of the shipped scenes.
std::vector<std::filesystem::path> scene_folders();

/// Returns `name_or_file` if it is a file; otherwise NAME.json in the first folder that contains it.
/// Fails   SceneError, which names the requested scene and the existing ones
std::filesystem::path find_scene(const std::string& name_or_file, const std::vector<std::filesystem::path>& folders);

}  // namespace tandem::server
