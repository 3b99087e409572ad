// Structures for tests: records in PDB format, and structure files that are deleted after the test.
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
  std::string name;  ///< padded with spaces to four columns: " CA ", "1HB "
  std::string residue = "ALA";
  int number = 1;
  char chain = 'A';
  char alternate = ' ';
  char insertion = ' ';
  double x = 0, y = 0, z = 0;
  std::string record = "ATOM";
  double occupancy = 1;
};

inline std::string to_text(const PdbLine& line) {
  std::array<char, 128> text = {};
  std::snprintf(text.data(), text.size(), "%-6s%5d %-4s%c%-4s%c%4d%c   %8.3f%8.3f%8.3f%6.2f  0.00\n",
                line.record.c_str(), 1, line.name.c_str(), line.alternate, line.residue.c_str(), line.chain,
                line.number, line.insertion, line.x, line.y, line.z, line.occupancy);
  return text.data();
}

/// Returns the PDB records of a residue. `atoms` lists its atoms, e.g. "N H CA C", each hydrogen after its carrier
/// atom. Heavy atoms are 3 Å apart, and hydrogens are 1 Å from their carrier. Consecutive residues are bonded: N or P
/// is 1.3 Å from C or O3' of the residue with the previous number.
inline std::string residue_text(const std::string& name, const std::string& atoms, int number, char chain = 'A') {
  constexpr double kResidueAngstrom = 10, kHalfBondAngstrom = 0.65, kApartAngstrom = 3;
  constexpr std::array<std::array<double, 2>, 4> kAround = {{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};
  std::istringstream words(atoms);
  std::string text;
  std::string atom;
  PdbLine line;
  std::size_t hydrogens = 0;
  double x = 0;
  for (PdbLine carrier; words >> atom;) {
    const std::size_t letter = atom.find_first_not_of("0123456789");
    const bool is_hydrogen = letter != std::string::npos && atom[letter] == 'H';
    if (is_hydrogen) {
      const std::array<double, 2> around = kAround.at(hydrogens++ % kAround.size());
      line = carrier;
      line.y += around[0];
      line.z += around[1];
    } else {
      const bool is_before = atom == "N" || atom == "P", is_behind = atom == "C" || atom == "O3'";
      x += is_before || is_behind ? 0 : kApartAngstrom;
      line.x = is_before || is_behind ? 0 : x;
      line.y = kResidueAngstrom * number;
      if (is_before) line.y -= kResidueAngstrom / 2 - kHalfBondAngstrom;
      if (is_behind) line.y += kResidueAngstrom / 2 - kHalfBondAngstrom;
      line.z = 0;
      carrier = line;
      hydrogens = 0;
    }
    line.name = atom.size() < 4 ? " " + atom : atom;
    line.residue = name;
    line.number = number;
    line.chain = chain;
    text += to_text(line);
  }
  return text;
}

class PdbFile {
 public:
  explicit PdbFile(const std::string& text) {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    std::string name = test != nullptr ? test->name() : "setup";
    std::replace(name.begin(), name.end(), '/', '_');  // a parameterised test has a slash in its name
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
