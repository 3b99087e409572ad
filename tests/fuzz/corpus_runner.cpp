// Runs a fuzz target without a fuzzer: over every *.hex file of a folder, each prefix of it, and each with single
// bytes changed. So the targets are built and run by every compiler; a fuzzer links them instead of this file.
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Input = std::vector<std::uint8_t>;

Input read_hex(const std::filesystem::path& path) {
  std::ifstream file(path);
  Input bytes;
  std::string digits;
  for (char c = 0; file.get(c);) {
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0) continue;
    digits += c;
    if (digits.size() < 2) continue;
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits, nullptr, 16)));
    digits.clear();
  }
  return bytes;
}

std::size_t run_around(Input input) {
  std::size_t runs = 0;
  for (std::size_t size = 0; size <= input.size(); ++size, ++runs) {
    const Input prefix(input.begin(), input.begin() + static_cast<std::ptrdiff_t>(size));
    LLVMFuzzerTestOneInput(prefix.data(), prefix.size());
  }
  for (std::uint8_t& byte : input) {
    for (const std::uint8_t other : {0x00, 0x01, 0x7f, 0x80, 0xff}) {
      const std::uint8_t original = std::exchange(byte, other);
      LLVMFuzzerTestOneInput(input.data(), input.size());
      byte = original;
      ++runs;
    }
  }
  return runs;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER_OF_HEX_FILES\n";
    return 2;
  }
  std::size_t runs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) {
    if (entry.path().extension() == ".hex") runs += run_around(read_hex(entry.path()));
  }
  std::cout << runs << " inputs\n";
  if (runs == 0) std::cerr << "no *.hex file in " << argv[1] << '\n';
  return runs == 0 ? 2 : 0;
}
