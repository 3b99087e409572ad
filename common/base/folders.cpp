#include "common/base/folders.hpp"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>

namespace tandem {
namespace {

bool write_parts(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts) {
  std::ofstream stream(file, std::ios::binary);
  for (const std::span<const std::byte> part : parts) {
    stream.write(reinterpret_cast<const char*>(part.data()), static_cast<std::streamsize>(part.size()));
  }
  stream.flush();
  return stream.good();
}

}  // namespace

std::filesystem::path data_folder() {
  const char* const chosen = std::getenv("TANDEM_DATA");
  if (chosen != nullptr && *chosen != '\0') return chosen;
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path() / TANDEM_DATA_FROM_PROGRAM).lexically_normal();
}

std::filesystem::path default_cache_directory() {
  const auto variable = [](const char* name) -> std::filesystem::path {
    const char* const value = std::getenv(name);
    return value == nullptr ? "" : value;
  };
  if (auto own = variable("TANDEM_CACHE"); !own.empty()) return own;
  if (const auto xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return xdg / "tandem";
  if (const auto home = variable("HOME"); !home.empty()) return home / ".cache" / "tandem";
  return {};
}

bool write_whole_file(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts) {
  static std::atomic<unsigned> serial{0};
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  const std::filesystem::path partial =
      file.string() + "." + std::to_string(getpid()) + "-" + std::to_string(serial++) + ".partial";
  bool is_there = write_parts(partial, parts);
  if (is_there) {
    std::filesystem::rename(partial, file, error);
    is_there = !error;
  }
  if (!is_there) std::filesystem::remove(partial, error);
  return is_there;
}

}  // namespace tandem
