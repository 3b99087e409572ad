#include "lab/results/output_folder.hpp"

#include <fstream>
#include <stdexcept>
#include <system_error>

namespace tandem::lab {

std::filesystem::path made_folder(const std::string& out) {
  std::error_code error;
  std::filesystem::create_directories(out, error);
  if (!std::filesystem::is_directory(out)) {
    throw std::invalid_argument("--out " + out + ": the folder cannot be made (" + error.message() +
                                "); check the path and its rights");
  }
  return out;
}

void write_text_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written; check the folder's rights and free space");
}

}  // namespace tandem::lab
