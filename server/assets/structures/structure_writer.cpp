// See structure_writer.hpp. pdb_reader.cpp lists the columns of the PDB format.
#include "server/assets/structures/structure_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/base/folders.hpp"
#include "server/assets/structures/residue_collector.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

using docking::Molecule;

constexpr std::size_t kMaxSerial = 99'999;
constexpr double kMinPdbCoordinate = -999.999, kMaxPdbCoordinate = 9999.999;  ///< limits of the PDB format [Å]
/// Largest number of characters of a remark's text in a line of 80 columns.
constexpr std::size_t kRemarkWidth = 69;
constexpr std::string_view kChainLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";
constexpr std::array<std::string_view, 8> kNucleotides = {"A", "C", "G", "U", "DA", "DC", "DG", "DT"};

/// One atom of the output.
struct Row {
  const Molecule* molecule = nullptr;
  std::size_t atom = 0;
  std::string_view chain;
  Vec3 position_angstrom = Vec3::Zero();  ///< position in the frame of the receptor's file
  bool is_standard = false;               ///< true: written as ATOM; false: as HETATM
  bool begins_residue = false;
  bool begins_chain = false;  ///< whether it is the first atom of a chain, or of a part of a chain after a TER

  const std::string& name() const { return molecule->atom_names[atom]; }
  const std::string& element() const { return molecule->elements[atom]; }
  const std::string& residue() const { return molecule->residue_names[atom]; }
  const std::string& id() const { return molecule->residue_ids[atom]; }
};

struct ResidueNumber {
  std::string number;
  std::string insertion;
};

/// Names of chains in the output, indexed by the names in the molecule.
using ChainNames = std::map<std::string, std::string, std::less<>>;

struct Complex {
  ChainNames receptor_chains, ligand_chains;
  std::vector<Row> rows;
  std::vector<std::string> remarks;
};

[[noreturn]] void refuse(const Row& row, const std::string& what) {
  const PdbResidue residue{row.residue(), row.id(), row.molecule->chains[row.atom], 0, {}};
  throw docking::MoleculeError("atom " + place_text(residue, row.name()) + ": " + what);
}

[[noreturn]] void refuse_in_pdb(const Row& row, const std::string& what) {
  refuse(row, what + "; write mmCIF (FILE.cif) instead");
}

/// Splits a residue number with insertion code, such as "12A", into 12 and A. Text that does not begin with a number is
/// returned unchanged as the number. Such text occurs in files with more than 9999 residues.
ResidueNumber number_of(const std::string& id) {
  std::size_t end = id.starts_with('-') ? 1 : 0;
  while (end < id.size() && is_digit(id[end])) ++end;
  if (end == 0 || !is_digit(id[end - 1])) return {id, ""};
  return {id.substr(0, end), id.substr(end)};
}

/// Returns the n-th chain name: A … Z, a … z, 0 … 9, then AA, AB, …
std::string chain_name(std::size_t n) {
  if (n < kChainLetters.size()) return std::string(1, kChainLetters[n]);
  std::string name;
  for (n -= kChainLetters.size() - 26;; n = n / 26 - 1) {
    name.insert(name.begin(), static_cast<char>('A' + n % 26));
    if (n < 26) return name;
  }
}

/// Chooses chain names for one molecule that differ from `others`, the names of the other molecule. `taken` contains
/// the names of both molecules.
ChainNames chain_names(const Molecule& molecule, const ChainNames& others, std::set<std::string>& taken) {
  ChainNames names;
  std::set<std::string> written_by_others;
  for (const auto& [own, written] : others) written_by_others.insert(written);
  std::size_t next = 0;
  for (const std::string& chain : molecule.chains) {
    const auto [entry, is_new] = names.try_emplace(chain, chain);
    if (!is_new || (!chain.empty() && !written_by_others.contains(chain))) continue;
    while (taken.contains(chain_name(next))) ++next;
    entry->second = chain_name(next);
    taken.insert(entry->second);
  }
  return names;
}

bool is_standard_residue(const Molecule& molecule, std::size_t first, std::size_t end) {
  const std::string& name = molecule.residue_names[first];
  if (std::find(kNucleotides.begin(), kNucleotides.end(), name) != kNucleotides.end()) return true;
  const auto begin = molecule.atom_names.begin() + static_cast<std::ptrdiff_t>(first);
  const auto behind = molecule.atom_names.begin() + static_cast<std::ptrdiff_t>(end);
  for (const char* const atom : {"N", "CA", "C"}) {
    if (std::find(begin, behind, atom) == behind) return false;
  }
  return true;
}

void check_printable(const Row& row) {
  const std::string text = row.name() + row.element() + row.residue() + row.id() + row.molecule->chains[row.atom];
  if (std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; })) return;
  refuse(row, "its name, residue or chain is not printable ASCII; correct it in its file");
}

void add_rows(const Molecule& molecule, const Pose& X, const ChainNames& chains, std::vector<Row>& rows) {
  const std::vector<std::size_t> starts = docking::residue_starts(molecule);
  for (std::size_t r = 0; r < starts.size(); ++r) {
    const std::size_t first = starts[r], end = r + 1 < starts.size() ? starts[r + 1] : molecule.size();
    Row row;
    row.molecule = &molecule;
    row.chain = chains.find(molecule.chains[first])->second;
    row.is_standard = is_standard_residue(molecule, first, end);
    for (std::size_t i = first; i < end; ++i) {
      row.atom = i;
      row.position_angstrom = X * molecule.positions_angstrom[i];
      row.begins_residue = i == first;
      row.begins_chain = i == 0 || (i == first && (molecule.chains[i] != molecule.chains[i - 1] ||
                                                   molecule.segments[i] != molecule.segments[i - 1]));
      check_printable(row);
      rows.push_back(row);
    }
  }
}

std::string numbers_text(const char* name, const Vec3& v) {
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), "%s %.9f %.9f %.9f", name, v.x(), v.y(), v.z());
  return text.data();
}

void add_chain_remarks(const char* which, const ChainNames& chains, std::vector<std::string>& remarks) {
  std::string list;
  for (const auto& [own, written] : chains) list += (list.empty() ? "" : ", ") + written;
  remarks.push_back(std::string("chains of the ") + which + ": " + list);
  for (const auto& [own, written] : chains) {
    if (own == written) continue;
    remarks.push_back("  chain " + written + " is " + (own.empty() ? "without a name" : "chain " + own) +
                      " in its own file");
  }
}

Complex complex_of(const Molecule& receptor, const Molecule& ligand, const Pose& X_AB,
                   std::span<const std::string> remarks) {
  if (!is_finite(X_AB)) throw std::invalid_argument("complex: the ligand's pose is not finite");
  Complex complex;
  std::set<std::string> taken(receptor.chains.begin(), receptor.chains.end());
  taken.insert(ligand.chains.begin(), ligand.chains.end());
  complex.receptor_chains = chain_names(receptor, {}, taken);
  complex.ligand_chains = chain_names(ligand, complex.receptor_chains, taken);
  add_rows(receptor, Pose{}, complex.receptor_chains, complex.rows);
  add_rows(ligand, X_AB, complex.ligand_chains, complex.rows);
  complex.remarks.assign(remarks.begin(), remarks.end());
  add_chain_remarks("receptor", complex.receptor_chains, complex.remarks);
  add_chain_remarks("ligand", complex.ligand_chains, complex.remarks);
  complex.remarks.emplace_back(
      "ligand here = R * ligand in its own file + t [angstrom]; the receptor is as in its file");
  const Eigen::Matrix3d R = X_AB.q.toRotationMatrix();
  for (int i = 0; i < 3; ++i) complex.remarks.push_back(numbers_text("R", R.row(i).transpose()));
  complex.remarks.push_back(numbers_text("t", X_AB.p));
  return complex;
}

/// Divides text into printable lines of at most `width` characters, at blanks where possible.
std::vector<std::string> divided(std::string text, std::size_t width) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  std::vector<std::string> lines;
  while (text.size() > width) {
    std::size_t end = text.rfind(' ', width);
    if (end == std::string::npos || end < width / 2) end = width;
    lines.push_back(text.substr(0, end));
    text.erase(0, text.find_first_not_of(' ', end));
  }
  lines.push_back(std::move(text));
  return lines;
}

/// Rounds to a multiple of 1/`decimals`. Returns 0 instead of -0.
double rounded(double value, double decimals) {
  return std::round(value * decimals) / decimals + 0.0;
}

void check_pdb(const Row& row, const ResidueNumber& number) {
  if (row.name().size() > 4) refuse_in_pdb(row, "PDB has 4 columns for the atom's name");
  if (row.element().size() > 2) refuse_in_pdb(row, "PDB has 2 columns for the element " + row.element());
  if (row.residue().size() > 4) refuse_in_pdb(row, "PDB has 4 columns for the residue's name " + row.residue());
  if (row.chain.size() > 1) refuse_in_pdb(row, "PDB has one column for the chain's name " + std::string(row.chain));
  if (number.number.size() > 4 || number.insertion.size() > 1) {
    refuse_in_pdb(row, "PDB has numbers of residues from -999 to 9999, with one letter more, not " + row.id());
  }
  for (const double value : row.position_angstrom) {
    const double coordinate = rounded(value, 1e3);
    if (coordinate >= kMinPdbCoordinate && coordinate <= kMaxPdbCoordinate) continue;
    refuse_in_pdb(row, "PDB has coordinates from -999.999 to 9999.999 A, not " + std::to_string(value));
  }
}

/// Returns the four columns of the atom name. The name begins in the second column, unless it has four letters or
/// begins with an element symbol of two letters.
std::string name_columns(const Row& row) {
  const bool fills_first =
      row.name().size() == 4 || (row.element().size() == 2 && row.name().starts_with(row.element()));
  return fills_first ? row.name() : " " + row.name();
}

std::string residue_columns(const Row& row, const ResidueNumber& number) {
  const std::string name = row.residue().size() == 4 ? row.residue() : row.residue() + " ";
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%4s%c%4s%c", name.c_str(), row.chain.front(), number.number.c_str(),
                number.insertion.empty() ? ' ' : number.insertion.front());
  return text.data();
}

std::size_t next_serial(std::size_t serial, const Row& row) {
  if (serial < kMaxSerial) return serial + 1;
  refuse_in_pdb(row, "PDB has serial numbers to 99999 for atoms and ends of chains, which this complex exceeds");
}

std::string quoted_value(const Row& row, const std::string& value) {
  constexpr std::string_view kSpecial = "_#$'\"[];";
  constexpr std::array<std::string_view, 5> kReserved = {"data_", "loop_", "save_", "stop_", "global_"};
  if (value.empty()) return ".";
  std::string lower = value;
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  const bool is_reserved = std::any_of(kReserved.begin(), kReserved.end(),
                                       [&lower](std::string_view word) { return lower.starts_with(word); });
  const bool is_plain = value.find(' ') == std::string::npos &&
                        kSpecial.find(value.front()) == std::string_view::npos && !is_reserved && value != "." &&
                        value != "?";
  if (is_plain) return value;
  for (const char quote : {'\'', '"'}) {
    if (value.find(quote) == std::string::npos) return quote + value + quote;
  }
  refuse(row, "mmCIF has no quotes for text with both kinds, " + value + "; correct it in its file");
}

/// Formats a coordinate with three decimals, or with up to six if it has more than three. The receptor's coordinates
/// are thus written as they are in its file.
std::string coordinate_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6f", rounded(value, 1e6));
  std::string digits = text.data();
  for (int spare = 3; spare > 0 && digits.back() == '0'; --spare) digits.pop_back();
  return digits;
}

constexpr std::string_view kMmcifLoop = R"(loop_
_atom_site.group_PDB
_atom_site.id
_atom_site.type_symbol
_atom_site.label_atom_id
_atom_site.label_alt_id
_atom_site.label_comp_id
_atom_site.label_asym_id
_atom_site.label_entity_id
_atom_site.label_seq_id
_atom_site.pdbx_PDB_ins_code
_atom_site.Cartn_x
_atom_site.Cartn_y
_atom_site.Cartn_z
_atom_site.occupancy
_atom_site.B_iso_or_equiv
_atom_site.auth_seq_id
_atom_site.auth_comp_id
_atom_site.auth_asym_id
_atom_site.auth_atom_id
_atom_site.pdbx_PDB_model_num
)";

std::string mmcif_row(const Row& row, std::size_t id, std::size_t part, std::size_t residue) {
  const ResidueNumber number = number_of(row.id());
  const std::string name = quoted_value(row, row.name()), comp = quoted_value(row, row.residue());
  const Vec3& p = row.position_angstrom;
  std::string text = row.is_standard ? "ATOM " : "HETATM ";
  for (const std::string& value :
       {std::to_string(id), quoted_value(row, row.element()), name, std::string("."), comp, chain_name(part - 1),
        std::to_string(part), row.is_standard ? std::to_string(residue) : ".",
        number.insertion.empty() ? "?" : quoted_value(row, number.insertion), coordinate_text(p.x()),
        coordinate_text(p.y()), coordinate_text(p.z()), std::string("1.00"), std::string("0.00"),
        quoted_value(row, number.number), comp, quoted_value(row, std::string(row.chain)), name}) {
    text += value + " ";
  }
  return text + "1\n";
}

std::string dielectric_text(const docking::FieldModel& model) {
  if (model.dielectric == docking::Dielectric::kNone) return "no charges";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", model.permittivity);
  return std::string("dielectric ") + text.data() + (model.dielectric == docking::Dielectric::kDistance ? "r" : "");
}

}  // namespace

std::string complex_pdb(const Molecule& receptor, const Molecule& ligand, const Pose& X_AB_angstrom,
                        std::span<const std::string> remarks) {
  const Complex complex = complex_of(receptor, ligand, X_AB_angstrom, remarks);
  std::string text;
  for (const std::string& remark : complex.remarks) {
    for (const std::string& line : divided(remark, kRemarkWidth)) text += "REMARK   6 " + line + "\n";
  }
  std::size_t serial = 0;
  std::array<char, 128> line{};
  for (std::size_t i = 0; i < complex.rows.size(); ++i) {
    const Row& row = complex.rows[i];
    const ResidueNumber number = number_of(row.id());
    check_pdb(row, number);
    const std::string residue = residue_columns(row, number);
    serial = next_serial(serial, row);
    const Vec3& p = row.position_angstrom;
    std::snprintf(line.data(), line.size(), "%-6s%5zu %-4s %s   %8.3f%8.3f%8.3f  1.00  0.00          %2s  \n",
                  row.is_standard ? "ATOM" : "HETATM", serial, name_columns(row).c_str(), residue.c_str(),
                  rounded(p.x(), 1e3), rounded(p.y(), 1e3), rounded(p.z(), 1e3), row.element().c_str());
    text += line.data();
    if (i + 1 < complex.rows.size() && !complex.rows[i + 1].begins_chain) continue;
    serial = next_serial(serial, row);
    std::snprintf(line.data(), line.size(), "TER   %5zu      %s\n", serial, residue.c_str());
    text += line.data();
  }
  return text + "END\n";
}

std::string complex_mmcif(const Molecule& receptor, const Molecule& ligand, const Pose& X_AB_angstrom,
                          std::span<const std::string> remarks) {
  const Complex complex = complex_of(receptor, ligand, X_AB_angstrom, remarks);
  std::string text = "data_complex\n";
  for (const std::string& remark : complex.remarks) text += "# " + divided(remark, remark.size() + 1).front() + "\n";
  text += kMmcifLoop;
  std::size_t part = 0, residue = 0;
  for (std::size_t i = 0; i < complex.rows.size(); ++i) {
    const Row& row = complex.rows[i];
    if (row.begins_chain) ++part, residue = 0;
    if (row.begins_residue) ++residue;
    text += mmcif_row(row, i + 1, part, residue);
  }
  return text + "#\n";
}

void check_complex_name(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  if (ending == ".pdb" || ending == ".cif") return;
  throw std::invalid_argument(file.string() + ": a complex is written as PDB or mmCIF; end its name in .pdb or .cif");
}

void save_complex(const std::filesystem::path& file, const Molecule& receptor, const Molecule& ligand,
                  const Pose& X_AB_angstrom, std::span<const std::string> remarks) {
  check_complex_name(file);
  std::string text;
  try {
    const auto write = file.extension() == ".cif" ? complex_mmcif : complex_pdb;
    text = write(receptor, ligand, X_AB_angstrom, remarks);
  } catch (const docking::MoleculeError& error) {
    throw docking::MoleculeError(file.string() + ": " + error.what());
  }
  if (const std::error_code error = replace_file(file, {std::as_bytes(std::span(text))})) {
    throw docking::MoleculeError(file.string() + ": cannot be written: " + error.message() + "; name another place");
  }
}

std::vector<std::string> energy_remarks(const docking::FieldResult& result, const docking::FieldModel& model) {
  std::array<char, 160> energy{}, cutoff{};
  std::snprintf(energy.data(), energy.size(), "Lennard-Jones %.6f, Coulomb %.6f, total %.6f kJ/mol",
                result.lennard_jones_kj_per_mol, result.coulomb_kj_per_mol, result.energy_kj_per_mol());
  std::snprintf(cutoff.data(), cutoff.size(), "cut-off %g angstrom", model.cutoff_angstrom);
  return {energy.data(), dielectric_text(model) + ", " + (model.cutoff_angstrom > 0 ? cutoff.data() : "no cut-off")};
}

}  // namespace tandem::server
