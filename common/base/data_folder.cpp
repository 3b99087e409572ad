#include "common/base/data_folder.hpp"

#include <cstdlib>
#include <system_error>

namespace tandem {

std::filesystem::path data_folder() {
  const char* const chosen = std::getenv("TANDEM_DATA");
  if (chosen != nullptr && *chosen != '\0') return chosen;
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path() / TANDEM_DATA_FROM_PROGRAM).lexically_normal();
}

}  // namespace tandem
