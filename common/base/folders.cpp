#include "common/base/folders.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "common/base/user_folders.hpp"

namespace tandem {
namespace {

using Parts = std::initializer_list<std::span<const std::byte>>;

std::error_code last_error() {
  return {errno, std::generic_category()};
}

bool write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t size = ::write(descriptor, bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(size));
  }
  return true;
}

/// Returns the value of an environment variable as a path; empty if it is not set.
std::filesystem::path variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

enum class Disk { kAwaited, kNotAwaited };

bool write_parts(int descriptor, Parts parts, unsigned mode, Disk disk) {
  return std::ranges::all_of(parts, [=](auto part) { return write_all(descriptor, part); }) &&
         ::fchmod(descriptor, mode) == 0 && (disk == Disk::kNotAwaited || ::fsync(descriptor) == 0);
}

enum class Old { kReplaced, kStays };

/// Suffix of the temporary name of an incomplete file; mkostemp(3) replaces each X by a random character.
constexpr std::string_view kUnfinished = ".XXXXXX";

bool is_unfinished(const std::string& name, const std::string& file) {
  if (!name.starts_with(file) || name.size() != file.size() + kUnfinished.size() || name[file.size()] != '.')
    return false;
  const auto is_alphanumeric = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
  };
  return std::all_of(name.begin() + static_cast<std::ptrdiff_t>(file.size()) + 1, name.end(), is_alphanumeric);
}

std::error_code write_file(const std::filesystem::path& file, Parts parts, unsigned mode, Old old, Disk disk) {
  std::error_code error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  std::string partial = file.string().append(kUnfinished);
  // mkostemp() creates the file with mode 0600; write_parts() sets the requested mode.
  const int descriptor = ::mkostemp(partial.data(), O_CLOEXEC);
  if (descriptor < 0) return last_error();
  error = write_parts(descriptor, parts, mode, disk) ? std::error_code{} : last_error();
  if (::close(descriptor) != 0 && !error) error = last_error();
  if (!error) {
    const auto name = old == Old::kReplaced ? ::rename : ::link;
    if (name(partial.c_str(), file.c_str()) != 0) error = last_error();
  }
  if (error || old == Old::kStays) ::unlink(partial.c_str());
  if (!error && disk == Disk::kAwaited) sync_folder(file.parent_path());
  return error;
}

/// Returns the path of the shared library that contains this code; empty if the code is linked into the program.
std::string own_library() {
  Dl_info info{};
  void* extra = nullptr;
  const int is_found = ::dladdr1(reinterpret_cast<const void*>(&own_library), &info, &extra, RTLD_DL_LINKMAP);
  const auto* const map = static_cast<const link_map*>(extra);
  return is_found != 0 && map != nullptr && map->l_name != nullptr ? map->l_name : "";
}

}  // namespace

std::filesystem::path program_folder() {
  std::error_code error;
  const std::string library = own_library();
  if (library.empty()) return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const std::filesystem::path file = std::filesystem::canonical(library, error);
  return error ? std::filesystem::path() : (file.parent_path() / TANDEM_PROGRAMS_FROM_LIBRARY).lexically_normal();
}

std::filesystem::path data_folder() {
  const char* const chosen = std::getenv("TANDEM_DATA");
  if (chosen != nullptr && *chosen != '\0') return chosen;
  return (program_folder() / TANDEM_DATA_FROM_PROGRAM).lexically_normal();
}

std::filesystem::path user_folder(const char* xdg, const std::filesystem::path& below_home) {
  if (auto chosen = variable(xdg); chosen.is_absolute()) return chosen;
  const auto home = variable("HOME");
  return home.empty() ? home : home / below_home;
}

void sync_folder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

std::filesystem::path default_cache_directory() {
  if (auto own = variable("TANDEM_CACHE"); !own.empty()) return own;
  const std::filesystem::path cache = user_folder("XDG_CACHE_HOME", ".cache");
  return cache.empty() ? cache : cache / "tandem";
}

std::error_code replace_file(const std::filesystem::path& file, Parts parts, unsigned mode) {
  return write_file(file, parts, mode, Old::kReplaced, Disk::kAwaited);
}

std::error_code replace_cache_file(const std::filesystem::path& file, Parts parts) {
  return write_file(file, parts, 0644, Old::kReplaced, Disk::kNotAwaited);
}

std::size_t remove_unfinished(const std::filesystem::path& file) {
  std::size_t number = 0;
  std::error_code error;
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    const bool is_file = entry->symlink_status(ignored).type() == std::filesystem::file_type::regular;
    if (!is_file || !is_unfinished(entry->path().filename().string(), file.filename().string())) continue;
    number += std::filesystem::remove(entry->path(), ignored) ? 1 : 0;
  }
  return number;
}

std::error_code write_new_file(const std::filesystem::path& file, Parts parts, unsigned mode) {
  return write_file(file, parts, mode, Old::kStays, Disk::kAwaited);
}

}  // namespace tandem
