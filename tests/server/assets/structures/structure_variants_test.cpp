// What programs make of one structure (other names, letters, columns, elements, orders) is read as the same structure, or is reported.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "common/docking/exact_field.hpp"
#include "server/assets/structures/loader.hpp"
#include "server/assets/structures/structure_writer.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/pdb_text.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using Random = std::mt19937_64;
using Lines = std::vector<std::string>;  ///< ATOM and HETATM records, 80 columns, and TER

std::string column(const std::string& line, std::size_t first, std::size_t last) {
  return line.substr(first - 1, last - first + 1);
}

void set_column(std::string& line, std::size_t first, const std::string& text) {
  line.replace(first - 1, text.size(), text);
}

bool is_atom(const std::string& line) {
  return line.starts_with("ATOM") || line.starts_with("HETATM");
}

std::string residue_key(const std::string& line) {
  return column(line, 18, 27);
}

bool is_hydrogen(const std::string& line) {
  return is_atom(line) && column(line, 77, 78) == " H";
}

std::string text_of(const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text + "END\n";
}

/// Calls `change` for the atoms of each residue.
void for_residues(Lines& lines, const std::function<void(Lines::iterator, Lines::iterator)>& change) {
  for (auto begin = lines.begin(); begin != lines.end();) {
    if (!is_atom(*begin)) {
      ++begin;
      continue;
    }
    auto end = begin;
    while (end != lines.end() && is_atom(*end) && residue_key(*end) == residue_key(*begin)) ++end;
    change(begin, end);
    begin = end;
  }
}

bool one_in(int n, Random& random) {
  return random() % static_cast<unsigned>(n) == 0;
}

void number_hydrogens(Lines& lines, Random&) {
  for_residues(lines, [](auto begin, auto end) {
    int n = 0;
    for (auto line = begin; line != end; ++line) {
      if (!is_hydrogen(*line)) continue;
      const std::string name = "H" + std::to_string(++n);
      set_column(*line, 13, (" " + name + "   ").substr(0, 4));
    }
  });
}

void swap_hydrogens_for_deuterium(Lines& lines, Random& random) {
  for (std::string& line : lines) {
    if (!is_hydrogen(line) || one_in(2, random)) continue;
    std::string name = column(line, 13, 16);
    name[name.find('H')] = 'D';
    set_column(line, 13, name);
    set_column(line, 77, " D");
  }
}

void put_digits_first(Lines& lines, Random&) {
  for (std::string& line : lines) {
    if (!is_hydrogen(line)) continue;
    std::string name = column(line, 13, 16);
    std::erase(name, ' ');
    if (!std::isdigit(static_cast<unsigned char>(name.back()))) continue;
    name = name.back() + name.substr(0, name.size() - 1);
    set_column(line, 13, (name + "    ").substr(0, 4));
  }
}

void shuffle_atoms(Lines& lines, Random& random) {
  for_residues(lines, [&random](auto begin, auto end) { std::shuffle(begin, end, random); });
}

void give_twice(Lines& lines, Random& random) {
  Lines more;
  for (const std::string& line : lines) {
    more.push_back(line);
    if (is_atom(line) && one_in(10, random)) more.push_back(line);
  }
  lines = more;
}

/// A second place of each atom of some residues, less occupied, before or behind the first.
void add_alternates(Lines& lines, Random& random) {
  Lines more;
  std::map<std::string, bool> has_alternates;
  for (std::string line : lines) {
    if (!is_atom(line)) {
      more.push_back(line);
      continue;
    }
    const auto [entry, is_new] = has_alternates.try_emplace(residue_key(line), one_in(4, random));
    if (!entry->second) {
      more.push_back(line);
      continue;
    }
    std::string other = line;
    const double x = std::stod(column(line, 31, 38)) + 0.7;
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "%8.3f", x);
    set_column(other, 31, text.data());
    set_column(other, 17, "A");
    set_column(other, 55, "  0.30");
    set_column(line, 17, "B");
    set_column(line, 55, "  0.70");
    more.push_back(one_in(2, random) ? other : line);
    more.push_back(more.back() == other ? line : other);
  }
  lines = more;
}

void move_chains_to_segments(Lines& lines, Random&) {
  std::erase_if(lines, [](const std::string& line) { return !is_atom(line); });
  for (std::string& line : lines) {
    set_column(line, 73, "P" + column(line, 22, 22) + "  ");
    set_column(line, 22, " ");
  }
}

void remove_elements(Lines& lines, Random&) {
  for (std::string& line : lines) {
    if (is_atom(line)) set_column(line, 77, "  ");
  }
}

void write_elements_in_small_letters(Lines& lines, Random&) {
  for (std::string& line : lines) {
    if (!is_atom(line)) continue;
    set_column(line, 78, std::string(1, static_cast<char>(std::tolower(static_cast<unsigned char>(line[77])))));
  }
}

/// As old files of the Protein Data Bank: its code and the number of the line in columns 73-80.
void number_lines(Lines& lines, Random&) {
  int n = 0;
  for (std::string& line : lines) {
    if (!is_atom(line)) continue;
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "3AL1%4d", ++n);
    set_column(line, 73, text.data());
  }
}

void align_names_left(Lines& lines, Random&) {
  for (std::string& line : lines) {
    if (!is_atom(line)) continue;
    std::string name = column(line, 13, 16);
    std::erase(name, ' ');
    set_column(line, 13, (name + "    ").substr(0, 4));
    set_column(line, 77, "  ");
  }
}

void cut_after_coordinates(Lines& lines, Random&) {
  for (std::string& line : lines) {
    if (is_atom(line)) line.resize(54);
  }
}

void remove_ends_of_chains(Lines& lines, Random&) {
  std::erase_if(lines, [](const std::string& line) { return !is_atom(line); });
}

/// Every residue a chain's end, as some programs write.
void end_chains_everywhere(Lines& lines, Random&) {
  Lines more;
  for_residues(lines, [&more](auto begin, auto end) {
    more.insert(more.end(), begin, end);
    more.emplace_back("TER");
  });
  lines = more;
}

struct Variant {
  const char* name;
  void (*change)(Lines&, Random&);
};

constexpr std::array kVariants = std::to_array<Variant>({
    {"hydrogens numbered by a viewer", number_hydrogens},
    {"deuterium", swap_hydrogens_for_deuterium},
    {"digits first", put_digits_first},
    {"atoms shuffled", shuffle_atoms},
    {"records twice", give_twice},
    {"alternates of less occupancy", add_alternates},
    {"segments in place of chains", move_chains_to_segments},
    {"no elements", remove_elements},
    {"elements in small letters", write_elements_in_small_letters},
    {"numbers of lines", number_lines},
    {"names to the left", align_names_left},
    {"nothing behind coordinates", cut_after_coordinates},
    {"no ends of chains", remove_ends_of_chains},
    {"ends of chains everywhere", end_chains_everywhere},
});

class Variants : public testing::Test {
 protected:
  struct Pair {
    docking::Molecule a, b;
    double energy = 0;
  };

  static Pair load(const std::filesystem::path& file, const std::string& a, const std::string& b) {
    Pair pair;
    pair.a = load_molecule(file, {{a}}, test::kOplsDirectory);
    pair.b = load_molecule(file, {{b}}, test::kOplsDirectory);
    pair.energy = docking::exact_field(pair.a, pair.b, Pose()).energy_kj_per_mol();
    return pair;
  }

  /// Both chains of a file with hydrogens that are all there, as lines of 80 columns.
  static Lines complete_lines(const std::filesystem::path& file, const std::string& a, const std::string& b) {
    const docking::Molecule first = load_molecule(file, {{a}}, test::kOplsDirectory, Hydrogens::kBuild);
    const docking::Molecule second = load_molecule(file, {{b}}, test::kOplsDirectory, Hydrogens::kBuild);
    std::istringstream text(complex_pdb(first, second, Pose()));
    Lines lines;
    for (std::string line; std::getline(text, line);) {
      if (is_atom(line)) line.resize(80, ' ');
      if (is_atom(line) || line.starts_with("TER")) lines.push_back(line.starts_with("TER") ? "TER" : line);
    }
    return lines;
  }
};

struct File {
  const char* path;
  const char* a;
  const char* b;
};

TEST_F(Variants, OfOneStructureHaveItsEnergy) {
  const std::array files = {File{"/usr/share/pymol/test/dat/3al1.pdb", "A", "B"},
                            File{"/usr/share/pymol/data/tut/1hpv.pdb", "A", "B"},
                            File{"/usr/share/pymol/data/demo/1tii.pdb", "D", "E"}};
  Random random(test::test_seed(1));
  std::size_t compared = 0;
  for (const File& source : files) {
    TANDEM_NEEDS_FILES(test::kOplsDirectory, source.path);
    const Lines lines = complete_lines(source.path, source.a, source.b);
    const test::PdbFile untouched(text_of(lines));
    const Pair expected = load(untouched.path(), source.a, source.b);
    ASSERT_TRUE(expected.a.guessed.empty() && expected.b.guessed.empty());
    ASSERT_GT(std::abs(expected.energy), 10) << "they touch: " << source.path;
    for (const Variant& variant : kVariants) {
      Lines changed = lines;
      variant.change(changed, random);
      const test::PdbFile file(text_of(changed));
      const bool has_segments = variant.change == move_chains_to_segments;
      const Pair found = load(file.path(), (has_segments ? "P" : "") + std::string(source.a),
                              (has_segments ? "P" : "") + std::string(source.b));
      const std::string what = std::string(source.path) + ", " + variant.name;
      EXPECT_EQ(found.a.size(), expected.a.size()) << what;
      EXPECT_EQ(found.b.size(), expected.b.size()) << what;
      EXPECT_NEAR(found.energy, expected.energy, 1e-6 * std::abs(expected.energy)) << what;
      ++compared;
    }
  }
  EXPECT_EQ(compared, files.size() * kVariants.size());
}

}  // namespace
}  // namespace tandem::server
