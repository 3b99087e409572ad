// Readers of GROMACS's parameter files. The formats are described in the GROMACS reference manual, "File formats" and
// "Force field organization". Their units are nm and kJ/mol. A block is the entry of one residue: its atoms, or its
// hydrogen rules.
#include "server/assets/structures/force_field.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <system_error>
#include <utility>

#include "server/assets/structures/loader.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string_view>;

constexpr double kAngstromsPerNanometre = 10;
constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{64} << 20;
constexpr const char* kRemedy =
    "; install the Debian package gromacs-data or name another folder of GROMACS parameters (*.ff)";

/// Returns the name in a section line "[ name ]"; empty for other lines.
std::string section_name(const Words& words) {
  if (words.front().front() != '[') return {};
  std::string joined;
  for (const std::string_view word : words) joined += word;
  const std::size_t end = joined.find(']');
  return end == std::string::npos ? std::string() : joined.substr(1, end - 1);
}

/// Reads a parameter file line by line, without comments and blank lines. Counts the lines for messages.
class ParameterFile {
 public:
  explicit ParameterFile(const fs::path& path) : path_(path.string()) {
    std::error_code error;
    const bool usable = fs::is_regular_file(path, error) && fs::file_size(path, error) <= kMaxFileBytes;
    std::ifstream file(path, std::ios::binary);
    if (!usable || !file) throw docking::MoleculeError("force-field file " + path_ + " cannot be read" + kRemedy);
    text_.assign(std::istreambuf_iterator<char>(file), {});
    rest_ = text_;
  }
  ParameterFile(const ParameterFile&) = delete;
  ParameterFile& operator=(const ParameterFile&) = delete;

  /// Reads the next nonempty line. Lines that a preprocessor without defined symbols would skip are skipped. Returns
  /// false at the end.
  bool next(Words& words) {
    while (!rest_.empty()) {
      ++line_;
      std::string_view line = pop_line(rest_);
      words = server::words(line.substr(0, line.find(';')));
      if (words.empty() || handled_by_preprocessor(words) || skipping_) continue;
      return true;
    }
    return false;
  }

  /// Reads the next line of the sections named `wanted` and skips all other sections. Returns false at the end.
  bool next_in(std::string_view wanted, Words& words) {
    while (next(words)) {
      if (std::string name = section_name(words); !name.empty()) {
        section_ = std::move(name);
      } else if (section_ == wanted) {
        return true;
      }
    }
    return false;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw docking::MoleculeError(path_ + ":" + std::to_string(line_) + ": " + what + kRemedy);
  }

  double number(std::string_view word) const {
    double value = 0;
    if (!parse_finite(word, value)) fail(quoted_text(word) + " is not a finite number");
    return value;
  }

 private:
  bool handled_by_preprocessor(const Words& words) {
    if (!words.front().starts_with('#')) return false;
    if (words.front() == "#ifdef" || words.front() == "#ifndef") {
      left_out_.push_back(words.front() == "#ifdef");
    } else if (words.front() == "#else" && !left_out_.empty()) {
      left_out_.back() = !left_out_.back();
    } else if (words.front() == "#endif" && !left_out_.empty()) {
      left_out_.pop_back();
    }
    skipping_ = std::find(left_out_.begin(), left_out_.end(), true) != left_out_.end();
    return true;
  }

  std::string path_;
  std::string text_;
  std::string_view rest_;
  std::string section_;  ///< current section of next_in()
  std::size_t line_ = 0;
  std::vector<bool> left_out_;  ///< one entry per open #if; true: its current branch is skipped
  bool skipping_ = false;
};

/// Reads how the σ of a pair of atom types is combined. Returns true for the arithmetic mean, false for the geometric
/// mean.
bool read_combination_rule(const fs::path& path) {
  ParameterFile file(path);
  Words words;
  if (!file.next_in("defaults", words)) file.fail("no [ defaults ] section");
  if (words.size() >= 2 && words[0] == "1" && (words[1] == "2" || words[1] == "3")) return words[1] == "2";
  file.fail("needs nbfunc 1 and comb-rule 2 or 3 (σ mixed arithmetically or geometrically), as in amber99sb.ff, " +
            std::string("charmm27.ff or oplsaa.ff; found ") + quoted_text(words[0]) + " and " +
            quoted_text(words.size() > 1 ? words[1] : std::string_view()));
}

/// Reads the atom types. Columns are counted from the right end of a line, because the column of the atomic number may
/// be missing.
void read_types(const fs::path& path, ForceField& force_field) {
  ParameterFile file(path);
  Words words;
  bool in_types = false;
  while (file.next(words)) {
    if (std::string name = section_name(words); !name.empty()) {
      if (name == "nonbond_params") file.fail("pairs of types with parameters of their own cannot be used");
      in_types = name == "atomtypes";
      continue;
    }
    if (!in_types) continue;
    if (words.size() < 7) file.fail("an atom type needs name, bond type, mass, charge, ptype, sigma and epsilon");
    const auto from_right = words.rbegin();
    AtomType type;
    type.epsilon_kj_per_mol = file.number(from_right[0]);
    type.sigma_angstrom = file.number(from_right[1]) * kAngstromsPerNanometre;
    type.mass_u = file.number(from_right[4]);
    force_field.types.insert_or_assign(std::string(words.front()), type);
  }
}

bool is_block_subsection(const std::string& name) {
  return name == "atoms" || name == "bonds" || name == "angles" || name == "dihedrals" || name == "impropers" ||
         name == "exclusions" || name == "cmap";
}

void read_blocks(const fs::path& path, const std::string& kind, ForceField& force_field) {
  ParameterFile file(path);
  Words words;
  std::string section;
  ResidueBlock* block = nullptr;
  while (file.next(words)) {
    if (const std::string name = section_name(words); !name.empty()) {
      section = name;
      if (is_block_subsection(name) || name == "bondedtypes") continue;
      block = &force_field.blocks[name];
      *block = {name, {}, kind};
    } else if (section == "atoms") {
      if (block == nullptr || words.size() < 3) file.fail("an atom of a residue needs name, type and charge");
      block->atoms.push_back({std::string(words[0]), std::string(words[1]), file.number(words[2])});
    }
  }
}

HydrogenRule read_rule(const ParameterFile& file, const Words& words) {
  if (words.size() < 4) file.fail("hydrogens need count, rule, name and the atom that carries them");
  HydrogenRule rule;
  rule.count = static_cast<int>(file.number(words[0]));
  rule.kind = static_cast<int>(file.number(words[1]));
  rule.name = words[2];
  rule.anchors.assign(words.begin() + 3, words.end());
  if (rule.count < 1 || rule.count > 4) file.fail("hydrogens need a count of 1 to 4");
  return rule;
}

/// Reads the hydrogen rules of all residues. A line such as "ALA 3" begins the rules of a residue; its number is
/// ignored. AMBER's files also have rules that add the oxygens of a C terminus. These rules are skipped, because
/// structure files contain the oxygens.
void read_hydrogens(const fs::path& path, ForceField& force_field) {
  ParameterFile file(path);
  Words words;
  std::vector<HydrogenRule>* rules = nullptr;
  while (file.next(words)) {
    if (words.size() <= 2) {
      // AMBER's RNA and DNA files contain residues with thymine twice. The last entry is used.
      rules = &force_field.hydrogens[std::string(words.front())];
      rules->clear();
    } else if (rules == nullptr) {
      file.fail("a rule before the first residue");
    } else if (HydrogenRule rule = read_rule(file, words); rule.name.starts_with('H')) {
      rules->push_back(std::move(rule));
    }
  }
}

/// Reads the entry of an atom that is added at a chain end. An entry "H" with a count of 3 adds H1, H2 and H3; with a
/// count of 1 it adds H.
void read_addition(ParameterFile& file, const Words& header, TerminusEdit& edit) {
  if (header.size() < 3) file.fail("an added atom needs count, rule and name");
  const int count = static_cast<int>(file.number(header[0]));
  const std::string name(header[2]);
  if (name.starts_with('H')) edit.hydrogens.push_back(read_rule(file, header));
  Words words;
  if (count < 1 || count > 4 || !file.next(words) || words.size() < 3) {
    file.fail("an added atom needs a count of 1 to 4 and a second line with type, mass and charge");
  }
  for (int i = 1; i <= count; ++i) {
    const std::string numbered = count == 1 ? name : name + std::to_string(i);
    edit.added.push_back({numbered, std::string(words[0]), file.number(words[2])});
  }
}

/// Reads a line "old [new] type mass charge". The new name is ignored, because only GROMACS uses it: structure files
/// contain the old name.
void read_replacement(const ParameterFile& file, const Words& words, TerminusEdit& edit) {
  if (words.size() < 4) file.fail("a replaced atom needs name, type, mass and charge");
  edit.replaced.push_back(
      {std::string(words[0]), std::string(words[words.size() - 3]), file.number(words[words.size() - 1])});
}

std::map<std::string, TerminusEdit, std::less<>> read_termini(const fs::path& path) {
  ParameterFile file(path);
  std::map<std::string, TerminusEdit, std::less<>> termini;
  Words words;
  std::string section;
  TerminusEdit* edit = nullptr;
  while (file.next(words)) {
    if (std::string name = section_name(words); !name.empty()) {
      if (name == "Add") name = "add";  // spelling in charmm27.ff
      section = name;
      if (name == "replace" || name == "add" || name == "delete" || is_block_subsection(name)) continue;
      edit = &termini[name];
    } else if (edit == nullptr) {
      file.fail("a line before the first [ terminus ]");
    } else if (section == "replace") {
      read_replacement(file, words, *edit);
    } else if (section == "add") {
      read_addition(file, words, *edit);
    } else if (section == "delete") {
      edit->deleted.emplace_back(words.front());
    }
  }
  return termini;
}

/// Removes the oxygens O1, O2 and OT from the edits of C termini. In GROMACS these are new names of the atoms O and
/// OXT, which structure files already contain.
void drop_renamed_additions(std::map<std::string, TerminusEdit, std::less<>>& c_termini) {
  for (auto& [name, edit] : c_termini) {
    std::erase_if(edit.added, [](const BlockAtom& atom) { return atom.name.starts_with('O'); });
    std::erase_if(edit.replaced, [](const BlockAtom& atom) { return atom.name.starts_with("OT"); });
  }
}

void read_block_names(const fs::path& path, ForceField& force_field) {
  Words words;
  ParameterFile residues(path);
  while (residues.next(words)) {
    if (words.size() < 2 || words[1] == "-") continue;
    force_field.block_of_residue.insert_or_assign(std::string(words[0]), std::string(words[1]));
    if (words.size() < 4 || words[2] == "-" || words[3] == "-") continue;
    const bool has_both = words.size() > 4 && words[4] != "-";
    force_field.end_blocks.insert_or_assign(
        std::string(words[1]),
        EndBlocks{std::string(words[2]), std::string(words[3]), std::string(has_both ? words[4] : std::string_view())});
  }
}

void read_block_aliases(const fs::path& path, ForceField& force_field) {
  Words words;
  ParameterFile own_names(path);
  while (own_names.next(words)) {
    if (words.size() < 3) own_names.fail("a name of an atom needs residue, name and the force field's name");
    force_field.block_aliases.push_back({std::string(words[0]), std::string(words[1]), std::string(words[2])});
  }
}

/// Reads the files of nucleotides if the folder contains them.
void read_nucleotides(const fs::path& directory, const char* stem, const char* kind, ForceField& force_field) {
  std::error_code error;
  const auto path = [&](const char* ending) { return directory / (std::string(stem) + ending); };
  if (!fs::exists(path(".rtp"), error)) return;
  read_blocks(path(".rtp"), kind, force_field);
  if (fs::exists(path(".hdb"), error)) read_hydrogens(path(".hdb"), force_field);
  if (fs::exists(path(".r2b"), error)) read_block_names(path(".r2b"), force_field);
  if (fs::exists(path(".arn"), error)) read_block_aliases(path(".arn"), force_field);
}

void read_names(const fs::path& directory, ForceField& force_field) {
  read_block_names(directory / "aminoacids.r2b", force_field);
  std::error_code error;
  if (fs::exists(directory / "aminoacids.arn", error)) read_block_aliases(directory / "aminoacids.arn", force_field);
  Words words;
  const bool own = fs::exists(directory / "xlateat.dat", error);
  ParameterFile atoms((own ? directory : directory / "..") / "xlateat.dat");
  while (atoms.next(words)) {
    if (words.size() < 3) continue;  // skips the first line, which contains only the number of entries
    force_field.aliases.push_back({std::string(words[0]), std::string(words[1]), std::string(words[2])});
  }
}

void add_stand_ins(ForceField& force_field) {
  for (const auto& [element, type] : built_in_force_field().types) {
    force_field.types.insert_or_assign(std::string(kElementPrefix) + element, type);
  }
}

}  // namespace

const BlockAtom* ResidueBlock::find(std::string_view atom) const {
  for (const BlockAtom& candidate : atoms) {
    if (candidate.name == atom) return &candidate;
  }
  return nullptr;
}

bool ResidueBlock::is_nucleotide() const {
  return find("C1'") != nullptr && find("O4'") != nullptr;
}

bool ResidueBlock::is_amino_acid() const {
  return find("N") != nullptr && find("CA") != nullptr && find("C") != nullptr && find("O") != nullptr;
}

const ResidueBlock* ForceField::block(std::string_view block_name) const {
  const auto found = blocks.find(block_name);
  return found == blocks.end() ? nullptr : &found->second;
}

const AtomType& ForceField::type(std::string_view type_name) const {
  const auto found = types.find(type_name);
  if (found == types.end()) {
    throw docking::MoleculeError("force field " + directory + ": atom type " + quoted_text(type_name) +
                                 " is not in ffnonbonded.itp" + kRemedy);
  }
  return found->second;
}

ForceField load_force_field(const fs::path& directory_or_name) {
  if (directory_or_name == kBuiltInForceField) return built_in_force_field();
  std::error_code error;
  fs::path directory = directory_or_name;
  if (!directory.has_parent_path() && !fs::is_directory(directory, error)) {
    directory = fs::path(kOplsDirectory).parent_path() / (directory.string() + ".ff");
  }
  if (!fs::is_directory(directory, error)) {
    throw docking::MoleculeError("force-field directory " + directory.string() + " does not exist" + kRemedy);
  }
  ForceField force_field;
  const fs::path folder = directory.has_filename() ? directory : directory.parent_path();
  force_field.name = folder.stem().string();
  force_field.directory = directory.string();
  force_field.mixes_arithmetically = read_combination_rule(directory / "forcefield.itp");
  read_types(directory / "ffnonbonded.itp", force_field);
  if (fs::exists(directory / "ffnanonbonded.itp", error)) read_types(directory / "ffnanonbonded.itp", force_field);
  add_stand_ins(force_field);
  read_blocks(directory / "aminoacids.rtp", "", force_field);
  read_hydrogens(directory / "aminoacids.hdb", force_field);
  force_field.n_termini = read_termini(directory / "aminoacids.n.tdb");
  force_field.c_termini = read_termini(directory / "aminoacids.c.tdb");
  drop_renamed_additions(force_field.c_termini);
  read_names(directory, force_field);
  read_nucleotides(directory, "dna", "DNA", force_field);
  read_nucleotides(directory, "rna", "RNA", force_field);
  return force_field;
}

}  // namespace tandem::server
