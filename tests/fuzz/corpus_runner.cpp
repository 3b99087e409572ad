// Runs a fuzz target without a fuzzer, so that every compiler can build and test the target. The inputs are:
//
// * every *.hex file of a folder;
// * prefixes of such a file, and copies of it with one changed byte;
// * every line of a text file, in hexadecimal.
//
// For slow targets, --around N limits the inputs from each *.hex file to about N.
#include <array>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Input = std::vector<std::uint8_t>;

Input from_hex(std::istream& file) {
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

std::size_t run(const Input& input) {
  LLVMFuzzerTestOneInput(input.data(), input.size());
  return 1;
}

constexpr std::array<std::uint8_t, 5> kOthers{0x00, 0x01, 0x7f, 0x80, 0xff};

std::size_t run_around(Input input, std::size_t most) {
  const std::size_t stride = 1 + input.size() * (1 + kOthers.size()) / most;
  std::size_t runs = run(input);
  for (std::size_t size = 0; size < input.size(); size += stride) runs += run({input.data(), input.data() + size});
  for (std::size_t i = 0; i < input.size(); i += stride) {
    for (const std::uint8_t other : kOthers) {
      const std::uint8_t original = std::exchange(input[i], other);
      runs += run(input);
      input[i] = original;
    }
  }
  return runs;
}

std::size_t run_folder(const std::filesystem::path& folder, std::size_t most) {
  std::size_t runs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".hex") continue;
    std::ifstream file(entry.path());
    runs += run_around(from_hex(file), most);
  }
  return runs;
}

std::size_t run_lines(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::size_t runs = 0;
  for (std::string line; std::getline(file, line);) {
    std::istringstream digits(line);
    runs += run(from_hex(digits));
  }
  return runs;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t most = std::numeric_limits<std::size_t>::max(), runs = 0;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--around" && i + 1 < argc) {
      most = std::stoul(argv[++i]);
      continue;
    }
    const std::size_t here = std::filesystem::is_directory(argument) ? run_folder(argument, most) : run_lines(argument);
    if (here == 0) {
      std::cerr << argument << ": no *.hex file, and no line in hexadecimal, to begin with\n";
      return 2;
    }
    runs += here;
  }
  if (runs == 0) std::cerr << "usage: " << argv[0] << " [--around N] FOLDER_OF_HEX_FILES|FILE_OF_LINES ...\n";
  if (runs > 0) std::cout << runs << " inputs\n";
  return runs == 0 ? 2 : 0;
}
