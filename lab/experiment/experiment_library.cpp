#include "lab/experiment/experiment_library.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/base/folders.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

fs::path experiment_file(const std::string& name) {
  if (fs::is_regular_file(name)) return name;
  const fs::path folder = shipped_experiments();
  const fs::path shipped = folder / (name + ".json");
  if (name.find('/') == std::string::npos && fs::is_regular_file(shipped)) return shipped;
  std::string known;
  for (const fs::path& file : files_in(folder)) known += (known.empty() ? "" : ", ") + file.stem().string();
  throw std::invalid_argument("experiment \"" + name + "\" is neither a file nor shipped; shipped: " + known);
}

}  // namespace

fs::path shipped_experiments() {
  const fs::path folder = data_folder() / "experiments";
  if (fs::is_directory(folder)) return folder;
  throw std::invalid_argument("the shipped experiments are not in " + folder.string() + "; name a file");
}

std::vector<fs::path> experiment_files(std::span<const std::string> names) {
  if (names.empty()) return files_in(shipped_experiments());
  std::vector<fs::path> files;
  for (const std::string& name : names) files.push_back(experiment_file(name));
  return files;
}

}  // namespace tandem::lab
