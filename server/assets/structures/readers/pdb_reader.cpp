// Fixed columns of the PDB format 3.3, https://www.wwpdb.org/documentation/file-format-content/format33/sect9.html:
//
//    1-6 record   13-16 name   17 alternate location   18-20 residue   22 chain   23-26 number
//   27 insertion code   31-38, 39-46, 47-54 x y z [Å]   55-60 occupancy   73-76 segment   77-78 element   79-80 charge
//
// The input may contain any bytes. Therefore the size of the file (structure_file.hpp), the number of atoms, and the
// number of atoms of one residue are bounded.
#include "server/assets/structures/readers/pdb_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "server/assets/structures/elements.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kLastCoordinateColumn = 54;
/// Atom types of AutoDock 4 with their elements. Listed are types that are no element symbol, or that are the symbol of
/// another element.
constexpr std::array<std::pair<std::string_view, std::string_view>, 13> kElementOfDockingType = {{{"A", "C"},
                                                                                                  {"C", "C"},
                                                                                                  {"N", "N"},
                                                                                                  {"NA", "N"},
                                                                                                  {"NS", "N"},
                                                                                                  {"O", "O"},
                                                                                                  {"OA", "O"},
                                                                                                  {"OS", "O"},
                                                                                                  {"S", "S"},
                                                                                                  {"SA", "S"},
                                                                                                  {"H", "H"},
                                                                                                  {"HD", "H"},
                                                                                                  {"HS", "H"}}};

class PdbParser {
 public:
  PdbParser(const std::string& source, PdbFlavour flavour) : source_(source), flavour_(flavour) {}

  PdbStructure parse(std::string_view text);

 private:
  [[noreturn]] void fail(const std::string& what) const;
  double coordinate(std::string_view line, std::size_t first, std::size_t last, char axis) const;
  std::string_view name_field(std::string_view line, std::string_view residue);
  void add_atom(std::string_view line);

  void add_docking_columns(std::string_view line, std::string_view residue, PdbAtom& atom) const;

  const std::string& source_;
  PdbFlavour flavour_;
  bool is_aligned_ = true;  ///< whether names of one-letter elements begin in column 14, as the format demands
  std::size_t line_ = 0;
  int segment_ = 0;
  ResidueCollector residues_;
};

void PdbParser::fail(const std::string& what) const {
  throw docking::MoleculeError(source_ + ":" + std::to_string(line_) + ": " + what);
}

double PdbParser::coordinate(std::string_view line, std::size_t first, std::size_t last, char axis) const {
  const std::string_view field = columns(line, first, last);
  double value = 0;
  if (!parse_finite(field, value) || std::abs(value) > kMaxCoordinateAngstrom) {
    fail(std::string("coordinate ") + axis + " in columns " + std::to_string(first) + "-" + std::to_string(last) +
         " is " + quoted_text(field) + ", not a number within 1e6 Å; correct or delete this line");
  }
  return value;
}

/// Returns the field of an atom name with all four columns if the columns determine the element, otherwise without
/// blanks. They determine nothing in a file that writes the name of an alpha carbon from column 13 on.
std::string_view PdbParser::name_field(std::string_view line, std::string_view residue) {
  const std::string_view field = line.substr(12, 4);
  if (field == "CA  " && is_standard_residue(residue)) is_aligned_ = false;
  return is_aligned_ ? field : trimmed(field);
}

/// Returns the segment name. The result is empty for a field without letters, because such a field is a line number.
std::string_view segment_name(std::string_view field) {
  const auto is_letter = [](char c) { return small_letter(c) >= 'a' && small_letter(c) <= 'z'; };
  return std::ranges::any_of(field, is_letter) ? field : std::string_view();
}

/// Parses a formal charge: "2+", "1-" or "-1". Returns 0 for any other text, such as a line number.
int formal_charge(std::string_view field) {
  if (field.size() != 2) return 0;
  const bool is_reversed = is_digit(field[1]);
  const char digit = field[is_reversed ? 1 : 0], sign = field[is_reversed ? 0 : 1];
  if (!is_digit(digit) || (sign != '+' && sign != '-')) return 0;
  return sign == '-' ? -(digit - '0') : digit - '0';
}

/// Reads AutoDock's charge in columns 67-76 and its atom type in 78-79.
void PdbParser::add_docking_columns(std::string_view line, std::string_view residue, PdbAtom& atom) const {
  double charge = 0;
  if (!parse_finite(columns(line, 67, 76), charge) || std::abs(charge) > kMaxCharge_e) {
    fail("charge in columns 67-76 is " + quoted_text(columns(line, 67, 76)) +
         ", not a number within 100 e; correct or delete this line");
  }
  atom.charge_e = charge;
  const std::string_view type = columns(line, 78, 79);
  atom.element = element_of({atom.name, type, residue});
  for (const auto& [docking_type, element] : kElementOfDockingType) {
    if (docking_type == type) atom.element = element;
  }
}

void PdbParser::add_atom(std::string_view line) {
  // A truncated coordinate would still parse as a number, but as a wrong one. The length of the line is therefore
  // checked.
  if (line.size() < kLastCoordinateColumn) {
    fail("atom line ends at column " + std::to_string(line.size()) +
         ", within the coordinates in columns 31-54; complete or delete this line");
  }
  PdbResidue residue;
  residue.name = columns(line, 18, 21);
  residue.chain = columns(line, 22, 22);
  residue.id = columns(line, 23, 27);
  residue.segment = segment_;
  if (flavour_ == PdbFlavour::kPdb) residue.segment_name = segment_name(columns(line, 73, 76));
  PdbAtom atom;
  atom.name = columns(line, 13, 16);
  atom.element = element_of({name_field(line, residue.name), columns(line, 77, 78), residue.name});
  if (double occupancy = 0; parse_finite(columns(line, 55, 60), occupancy)) atom.occupancy = occupancy;
  atom.formal_charge_e = formal_charge(columns(line, 79, 80));
  atom.position_angstrom = {coordinate(line, 31, 38, 'x'), coordinate(line, 39, 46, 'y'),
                            coordinate(line, 47, 54, 'z')};
  if (flavour_ == PdbFlavour::kPdbqt) add_docking_columns(line, residue.name, atom);
  try {
    residues_.add(std::move(residue), std::move(atom), line[16]);
  } catch (const docking::MoleculeError& error) {
    fail(error.what());
  }
}

PdbStructure PdbParser::parse(std::string_view text) {
  bool has_more_models = false;
  while (!text.empty()) {
    const std::string_view line = pop_line(text);
    ++line_;
    const std::string_view record = columns(line, 1, 6);
    if (record == "ATOM" || record == "HETATM") {
      add_atom(line);
    } else if (record == "TER") {
      ++segment_;
    } else if (residues_.atom_count() > 0 && (record == "ENDMDL" || record == "END" || record == "MODEL")) {
      has_more_models = text.find("\nATOM") != std::string_view::npos || text.starts_with("ATOM");
      break;
    }
  }
  PdbStructure structure = residues_.finish();
  structure.has_more_models = has_more_models;
  return structure;
}

}  // namespace

PdbStructure parse_pdb(std::string_view text, const std::string& source, PdbFlavour flavour) {
  return PdbParser(source, flavour).parse(text);
}

}  // namespace tandem::server
