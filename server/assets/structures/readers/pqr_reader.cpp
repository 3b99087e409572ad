// See pqr_reader.hpp. Format: PDB2PQR's documentation, "PQR molecular structure format".
#include "server/assets/structures/readers/pqr_reader.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "server/assets/structures/elements.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr double kMaxRadiusAngstrom = 10;

/// Returns the fields after the record name. A six-digit serial number may follow the record name without a blank.
std::vector<std::string_view> fields_of(std::string_view line) {
  const std::size_t record = line.starts_with("HETATM") ? 6 : 4;
  return words(line.substr(record));
}

bool is_chain_end(std::string_view residue) {
  return residue == "NTER" || residue == "NTE" || residue == "CTER" || residue == "CTE";
}

/// Returns true for a chain and number without a blank between them, which occur from residue 1000 on: "A1000", "B-5",
/// "A12B".
bool has_chain_before_number(std::string_view field) {
  if (field.size() < 2 || is_digit(field[0]) || field[0] == '-') return false;
  return is_digit(field[1]) || (field[1] == '-' && field.size() > 2 && is_digit(field[2]));
}

struct PqrRecord {
  std::string_view name, residue, chain, id, element;
  std::array<double, 5> numbers{};  ///< x y z [Å], charge [e], radius [Å]
};

/// Reads fields separated by blanks, as the format defines. Open Babel writes an additional element after the radius.
bool read_words(std::string_view line, PqrRecord& record) {
  std::vector<std::string_view> fields = fields_of(line);
  if (double number = 0; fields.size() > 9 && !parse_finite(fields.back(), number)) {
    record.element = fields.back();
    fields.pop_back();
  }
  const std::size_t count = record.numbers.size();
  if (fields.size() < 9 || fields.size() > 10) return false;
  for (std::size_t i = 0; i < count; ++i) {
    if (!parse_finite(fields[fields.size() - count + i], record.numbers[i])) return false;
  }
  record.name = fields[1];
  record.residue = fields[2];
  record.id = fields[fields.size() - count - 1];
  if (fields.size() == 10) {
    record.chain = fields[3];
  } else if (has_chain_before_number(record.id)) {
    record.chain = record.id.substr(0, 1);
    record.id.remove_prefix(1);
  }
  return true;
}

/// Reads fixed columns, as PDB2PQR writes them: those of PDB up to the coordinates, followed by "%8.4f%7.4f". Wide
/// numbers in this form have no blanks between them, so the line cannot be split into words.
bool read_columns(std::string_view line, PqrRecord& record) {
  constexpr std::array<std::array<std::size_t, 2>, 5> kColumns = {{{31, 38}, {39, 46}, {47, 54}, {55, 62}, {63, 69}}};
  for (std::size_t i = 0; i < record.numbers.size(); ++i) {
    if (!parse_finite(columns(line, kColumns[i][0], kColumns[i][1]), record.numbers[i])) return false;
  }
  record.name = columns(line, 13, 16);
  record.residue = columns(line, 18, 21);
  record.chain = columns(line, 22, 22);
  record.id = columns(line, 23, 27);
  return !record.name.empty();
}

bool add_atom(std::string_view line, int segment, ResidueCollector& residues) {
  PqrRecord record;
  if (!read_words(line, record) && !read_columns(line, record)) return false;
  const auto& [x, y, z, charge, radius] = record.numbers;
  const Vec3 position(x, y, z);
  if (position.cwiseAbs().maxCoeff() > kMaxCoordinateAngstrom) return false;
  if (std::abs(charge) > kMaxCharge_e || radius < 0 || radius > kMaxRadiusAngstrom) return false;
  PdbResidue residue;
  residue.name = record.residue;
  residue.id = record.id;
  residue.chain = record.chain;
  residue.segment = segment;
  PdbAtom atom;
  atom.name = record.name;
  atom.element = element_of({atom.name, record.element, residue.name});
  atom.position_angstrom = position;
  atom.charge_e = charge;
  atom.radius_angstrom = radius;
  residues.add(std::move(residue), std::move(atom), ' ');
  return true;
}

/// Joins residues that are split at a chain end: "NTER 4" and "GLU 4" are parts of one residue, a glutamate.
void join_chain_ends(std::vector<PdbResidue>& residues) {
  std::vector<PdbResidue> joined;
  for (PdbResidue& residue : residues) {
    const bool continues = !joined.empty() && joined.back().id == residue.id && joined.back().chain == residue.chain &&
                           joined.back().segment == residue.segment &&
                           (is_chain_end(joined.back().name) || is_chain_end(residue.name));
    if (!continues) {
      joined.push_back(std::move(residue));
      continue;
    }
    if (is_chain_end(joined.back().name)) joined.back().name = residue.name;
    for (PdbAtom& atom : residue.atoms) joined.back().atoms.push_back(std::move(atom));
  }
  residues = std::move(joined);
}

}  // namespace

PdbStructure parse_pqr(std::string_view text, const std::string& source) {
  ResidueCollector residues;
  int segment = 0;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = pop_line(text);
    if (line.starts_with("TER")) ++segment;
    if (line == "END") break;
    if (!line.starts_with("ATOM") && !line.starts_with("HETATM")) continue;
    if (!add_atom(line, segment, residues)) {
      throw docking::MoleculeError(
          source + ":" + std::to_string(number) +
          ": not a PQR record: serial, atom, residue, number, x, y, z, charge within 100 e and "
          "radius within 10 Å, divided by blanks, are needed; correct or delete this line");
    }
  }
  PdbStructure structure = residues.finish();
  join_chain_ends(structure.residues);
  return structure;
}

}  // namespace tandem::server
