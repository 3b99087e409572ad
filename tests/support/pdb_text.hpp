// Writes structures for tests: records of the PDB format, and files that vanish after the test.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace tandem::test {

struct PdbLine {
  std::string name;  ///< with its columns: " CA ", "1HB "
  std::string residue = "ALA";
  int number = 1;
  char chain = 'A';
  char alternate = ' ';
  char insertion = ' ';
  double x = 0, y = 0, z = 0;
  std::string record = "ATOM";
};

inline std::string to_text(const PdbLine& line) {
  std::array<char, 128> text = {};
  std::snprintf(text.data(), text.size(), "%-6s%5d %-4s%c%-4s%c%4d%c   %8.3f%8.3f%8.3f  1.00  0.00\n",
                line.record.c_str(), 1, line.name.c_str(), line.alternate, line.residue.c_str(), line.chain,
                line.number, line.insertion, line.x, line.y, line.z);
  return text.data();
}

/// Atoms given as "N CA C", one at each Å of a line.
inline std::string residue_text(const std::string& name, const std::string& atoms, int number, char chain = 'A') {
  std::istringstream words(atoms);
  std::string text;
  std::string atom;
  for (double x = 0; words >> atom; x += 1.0) {
    PdbLine line;
    line.name = atom.size() < 4 ? " " + atom : atom;
    line.residue = name;
    line.number = number;
    line.chain = chain;
    line.x = x;
    line.y = 10.0 * number;
    text += to_text(line);
  }
  return text;
}

class PdbFile {
 public:
  explicit PdbFile(const std::string& text) {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    std::string name = test != nullptr ? test->name() : "setup";
    std::replace(name.begin(), name.end(), '/', '_');  // of a parameter
    path_ = std::filesystem::temp_directory_path() / ("tandem_" + std::to_string(getpid()) + "_" + name + ".pdb");
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~PdbFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  PdbFile(const PdbFile&) = delete;
  PdbFile& operator=(const PdbFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace tandem::test
