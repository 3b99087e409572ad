#include "tests/support/source_path.hpp"

namespace tandem::test {

std::filesystem::path source_path(std::string_view relative) {
  return std::filesystem::path(TANDEM_SOURCE_FOLDER) / relative;
}

}  // namespace tandem::test
