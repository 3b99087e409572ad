// Tests one structure in the variants that different programs write: names, letters, columns, elements, orders. Each
// variant must be read as the same structure, or the difference must be reported. A silent difference is a fault.
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
using Lines = std::vector<std::string>;  ///< ATOM, HETATM and TER records of 80 columns

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

/// Calls `change` for the atoms of each residue, as a range of lines.
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

void write_digits_first(Lines& lines, Random&) {
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

/// Gives each atom of some residues a second location of lower occupancy, before or after the first location.
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

/// Numbers the lines as old files of the Protein Data Bank do: PDB code and line number in columns 73-80.
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

/// Ends the chain after every residue (TER), as some programs do.
void end_chains_everywhere(Lines& lines, Random&) {
  Lines more;
  for_residues(lines, [&more](auto begin, auto end) {
    more.insert(more.end(), begin, end);
    more.emplace_back("TER");
  });
  lines = more;
}

/// Uses CHARMM's names for the hydrogen on N and the oxygen at the end of a chain.
void use_charmm_names(Lines& lines, Random&) {
  for (std::string& line : lines) {
    if (!is_atom(line)) continue;
    const std::string name = column(line, 13, 16);
    if (name == " H  ") set_column(line, 13, " HN ");
    if (name == " CD1" && column(line, 18, 20) == "ILE") set_column(line, 13, " CD ");
    if (name == " OXT") set_column(line, 13, " OT2");
  }
}

void renumber_residues(Lines& lines, Random& random) {
  const int offset = static_cast<int>(random() % 3000) - 100;
  for (std::string& line : lines) {
    if (!is_atom(line)) continue;
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "%4d", std::stoi(column(line, 23, 26)) + offset);
    set_column(line, 23, text.data());
  }
}

/// Gives every second residue the number of the previous residue with an insertion letter.
void insert_residues(Lines& lines, Random&) {
  std::map<std::string, int> count;
  for_residues(lines, [&count](auto begin, auto end) {
    const int n = ++count[column(*begin, 22, 22)];
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "%4d%c", 1 + n / 2, n % 2 == 0 ? ' ' : 'A');
    for (auto line = begin; line != end; ++line) set_column(*line, 23, text.data());
  });
}

void end_lines_as_windows_does(Lines& lines, Random&) {
  for (std::string& line : lines) line += "\r";
}

void write_hetatm(Lines& lines, Random& random) {
  for (std::string& line : lines) {
    if (line.starts_with("ATOM") && one_in(20, random)) set_column(line, 1, "HETATM");
  }
}

/// Writes serial numbers that reach six digits, which are one column too wide. From there on, all other columns are
/// shifted to the right.
void drift_columns(Lines& lines, Random& random) {
  int serial = 99'990 - static_cast<int>(random() % 50);
  for (std::string& line : lines) {
    if (!is_atom(line)) continue;
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "%5d", ++serial);
    line.replace(6, 5, text.data());
  }
}

void shift_some_lines(Lines& lines, Random& random) {
  for (std::string& line : lines) {
    if (is_atom(line) && one_in(50, random)) line.insert(30, " ");
  }
}

void remove_a_residue(Lines& lines, Random& random) {
  std::size_t n = random() % lines.size();
  while (!is_atom(lines[n])) n = (n + 1) % lines.size();
  const std::string victim = residue_key(lines[n]);
  std::erase_if(lines, [&victim](const std::string& line) { return is_atom(line) && residue_key(line) == victim; });
}

void remove_some_atoms(Lines& lines, Random& random) {
  std::erase_if(lines, [&random](const std::string& line) { return is_atom(line) && one_in(200, random); });
}

void move_hydrogens_away(Lines& lines, Random& random) {
  for (std::string& line : lines) {
    if (!is_hydrogen(line) || !one_in(40, random)) continue;
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "%8.3f", std::stod(column(line, 31, 38)) + 4);
    set_column(line, 31, text.data());
  }
}

/// Gives some residues a second location of equal occupancy. The choice between equal locations is arbitrary, so the
/// reader must report it.
void add_equal_alternates(Lines& lines, Random& random) {
  add_alternates(lines, random);
  for (std::string& line : lines) {
    if (is_atom(line) && column(line, 17, 17) != " ") set_column(line, 55, "  0.50");
  }
}

enum class Keeps {
  kEnergy,   ///< the atoms stay the same: the energy must equal that of the original file
  kIsNamed,  ///< the atoms differ or are chosen arbitrarily: a changed energy must be reported
};

/// One way to change a file. Changes are applied in the order of their stages, at most one of each stage. A change must
/// keep the columns that changes of later stages need.
struct Variant {
  const char* name;
  void (*change)(Lines&, Random&);
  int stage;
  Keeps keeps = Keeps::kEnergy;
};

constexpr int kStages = 6;
constexpr std::array kVariants = std::to_array<Variant>({
    {"hydrogens numbered by a viewer", number_hydrogens, 0},
    {"deuterium", swap_hydrogens_for_deuterium, 0},
    {"digits first", write_digits_first, 0},
    {"names of CHARMM", use_charmm_names, 0},
    {"a residue missing", remove_a_residue, 1, Keeps::kIsNamed},
    {"atoms missing", remove_some_atoms, 1, Keeps::kIsNamed},
    {"hydrogens away from their atoms", move_hydrogens_away, 1, Keeps::kIsNamed},
    {"atoms shuffled", shuffle_atoms, 1},
    {"HETATM", write_hetatm, 1},
    {"records twice", give_twice, 2},
    {"alternates of less occupancy", add_alternates, 2},
    {"alternates of equal occupancy", add_equal_alternates, 2, Keeps::kIsNamed},
    {"residues renumbered", renumber_residues, 3},
    {"residues inserted", insert_residues, 3},
    {"segments in place of chains", move_chains_to_segments, 4},
    {"no ends of chains", remove_ends_of_chains, 4},
    {"ends of chains everywhere", end_chains_everywhere, 4},
    {"no elements", remove_elements, 5},
    {"elements in small letters", write_elements_in_small_letters, 5},
    {"numbers of lines", number_lines, 5},
    {"names to the left", align_names_left, 5},
    {"nothing behind coordinates", cut_after_coordinates, 5},
    {"lines that end as on Windows", end_lines_as_windows_does, 5},
    {"six digits push columns", drift_columns, 5, Keeps::kIsNamed},
    {"some lines shifted", shift_some_lines, 5, Keeps::kIsNamed},
});

/// Returns whether two variants cannot be combined, because one of them removes columns that the other one writes.
bool exclude_each_other(const Variant& one, const Variant& other) {
  const auto has_alternates = [](const Variant& v) {
    return v.change == add_alternates || v.change == add_equal_alternates;
  };
  const auto ends_early = [](const Variant& v) {
    return v.change == cut_after_coordinates || v.change == number_lines;
  };
  return (has_alternates(one) && other.change == cut_after_coordinates) ||
         (one.change == move_chains_to_segments && ends_early(other));
}

/// Selects for each stage one variant at random, or none, in the order of the stages.
std::vector<const Variant*> some_variants(Random& random) {
  std::vector<const Variant*> chosen;
  for (int stage = 0; stage < kStages; ++stage) {
    std::vector<const Variant*> of_stage;
    for (const Variant& variant : kVariants) {
      const auto conflicts = [&variant](const Variant* before) { return exclude_each_other(*before, variant); };
      if (variant.stage == stage && std::ranges::none_of(chosen, conflicts)) of_stage.push_back(&variant);
    }
    if (one_in(2, random)) chosen.push_back(of_stage[random() % of_stage.size()]);
  }
  return chosen;
}

class Variants : public testing::Test {
 protected:
  struct Pair {
    docking::Molecule a, b;
    double energy = 0;
    std::size_t reported = 0;  ///< number of reports: notes, guesses, missing or omitted atoms, and gaps
  };

  static Pair load(const std::filesystem::path& file, const std::string& a, const std::string& b) {
    Pair pair;
    StructureReport of_a, of_b;
    pair.a = load_molecule(file, {{a}}, test::kOplsDirectory, Hydrogens::kGiven, &of_a);
    pair.b = load_molecule(file, {{b}}, test::kOplsDirectory, Hydrogens::kGiven, &of_b);
    pair.energy = docking::exact_field(pair.a, pair.b, Pose()).energy_kj_per_mol();
    for (const auto* molecule : {&pair.a, &pair.b}) {
      pair.reported += molecule->guessed.size();
      for (const std::string& note : molecule->notes) pair.reported += note.find("net charge") != 0 ? 1 : 0;
    }
    for (const auto* report : {&of_a, &of_b}) {
      pair.reported += report->missing.size() + report->dropped.size() + report->gaps.size() + report->moved.size();
    }
    return pair;
  }

  /// Returns both chains of a file, completed with hydrogens, as lines of 80 columns.
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
constexpr std::array kFiles = {
    File{"/usr/share/pymol/test/dat/3al1.pdb", "A", "B"}, File{"/usr/share/pymol/data/tut/1hpv.pdb", "A", "B"},
    File{"/usr/share/pymol/data/demo/1tii.pdb", "D", "E"}, File{"/usr/share/freesasa/test-data/2jo4.pdb", "A", "B"},
    File{"/usr/share/freesasa/test-data/1a0q.pdb", "L", "H"}};

class VariantsOfFile : public Variants, public testing::WithParamInterface<File> {
 protected:
  void SetUp() override { TANDEM_NEEDS_FILES(test::kOplsDirectory, GetParam().path); }

  void untouched() {
    lines_ = complete_lines(GetParam().path, GetParam().a, GetParam().b);
    const test::PdbFile file(text_of(lines_));
    expected_ = load(file.path(), GetParam().a, GetParam().b);
    ASSERT_TRUE(expected_.a.guessed.empty() && expected_.b.guessed.empty());
    ASSERT_GT(std::abs(expected_.energy), 10) << "they touch";
  }

  /// Checks that the changed file has the energy of the original file. If one of the variants permits a difference, a
  /// report or a refusal is accepted as well.
  void check(const std::vector<const Variant*>& variants, Random& random) {
    Lines changed = lines_;
    bool may_differ = false, has_segments = false;
    std::string what = GetParam().path;
    for (const Variant* variant : variants) {
      variant->change(changed, random);
      may_differ |= variant->keeps == Keeps::kIsNamed;
      has_segments |= variant->change == move_chains_to_segments;
      what += std::string(", ") + variant->name;
    }
    const test::PdbFile file(text_of(changed));
    const std::string letter = has_segments ? "P" : "";
    try {
      const Pair found = load(file.path(), letter + GetParam().a, letter + GetParam().b);
      const bool is_same = std::abs(found.energy - expected_.energy) <= 1e-6 * std::abs(expected_.energy);
      if (may_differ) {
        EXPECT_TRUE(is_same || found.reported > expected_.reported)
            << what << ": " << found.energy << " kJ/mol in place of " << expected_.energy
            << ", and nothing is reported";
        return;
      }
      EXPECT_EQ(found.a.size(), expected_.a.size()) << what;
      EXPECT_EQ(found.b.size(), expected_.b.size()) << what;
      EXPECT_TRUE(is_same) << what << ": " << found.energy << " kJ/mol in place of " << expected_.energy;
    } catch (const docking::MoleculeError& error) {
      EXPECT_TRUE(may_differ) << what << ": " << error.what();
      EXPECT_NE(std::string(error.what()).find(file.path().string()), std::string::npos) << error.what();
    }
  }

  void check_some(int count) {
    untouched();
    Random random(test::test_seed(1));
    for (int n = 0; n < count && !HasFailure(); ++n) check(some_variants(random), random);
  }

 private:
  Lines lines_;
  Pair expected_;
};

TEST_P(VariantsOfFile, OneByOneHaveItsEnergy) {
  untouched();
  Random random(test::test_seed(1));
  for (const Variant& variant : kVariants) check({&variant}, random);
}

TEST_P(VariantsOfFile, TogetherHaveItsEnergy) {
  check_some(12);
}

TEST_P(VariantsOfFile, TwoHundredTogetherHaveItsEnergy) {
  check_some(200);
}

INSTANTIATE_TEST_SUITE_P(OfDebian, VariantsOfFile, testing::ValuesIn(kFiles),
                         [](const auto& test) { return std::filesystem::path(test.param.path).stem().string(); });

}  // namespace
}  // namespace tandem::server
