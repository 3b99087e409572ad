#include "server/assets/scene_library.hpp"

#include <set>

#include "common/base/folders.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::server {
namespace fs = std::filesystem;

std::vector<fs::path> scene_folders() {
  return {data_folder() / "scenes"};
}

fs::path find_scene(const std::string& name_or_file, const std::vector<fs::path>& folders) {
  std::error_code error;
  if (fs::is_regular_file(name_or_file, error)) return name_or_file;
  std::set<std::string> known;
  for (const fs::path& folder : folders) {
    const fs::path candidate = folder / (name_or_file + ".json");
    if (fs::is_regular_file(candidate, error)) return candidate;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      if (entry.path().extension() == ".json") known.insert(entry.path().stem().string());
    }
  }
  std::string names;
  for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
  throw SceneError("scene \"" + name_or_file +
                   "\" is neither a file nor a known scene; known: " + (names.empty() ? "none" : names));
}

}  // namespace tandem::server
