// See pqr_reader.hpp. Format: PDB2PQR's documentation, "PQR molecular structure format".
#include "server/assets/structures/pqr_reader.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr double kMaxCharge_e = 100;
constexpr double kMaxRadiusAngstrom = 10;

/// Four-letter atom names and serials of six digits may leave no blank after the record's name.
std::vector<std::string_view> fields_of(std::string_view line) {
  const std::size_t record = line.starts_with("HETATM") ? 6 : 4;
  return words(line.substr(record));
}

bool is_chain_end(std::string_view residue) {
  return residue == "NTER" || residue == "NTE" || residue == "CTER" || residue == "CTE";
}

bool add_atom(std::string_view line, int segment, ResidueCollector& residues) {
  const std::vector<std::string_view> fields = fields_of(line);
  if (fields.size() < 9) return false;
  std::array<double, 5> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!parse_finite(fields[fields.size() - numbers.size() + i], numbers[i])) return false;
  }
  const auto& [x, y, z, charge, radius] = numbers;
  const Vec3 position(x, y, z);
  if (position.cwiseAbs().maxCoeff() > kMaxCoordinateAngstrom) return false;
  if (std::abs(charge) > kMaxCharge_e || radius < 0 || radius > kMaxRadiusAngstrom) return false;
  PdbResidue residue;
  residue.name = fields[2];
  residue.id = fields[fields.size() - 6];
  residue.chain = fields.size() > 9 ? fields[3] : std::string_view();
  residue.segment = segment;
  PdbAtom atom;
  atom.name = fields[1];
  atom.element = element_of(atom.name, {}, residue.name);
  atom.position_angstrom = position;
  atom.charge_e = charge;
  atom.radius_angstrom = radius;
  residues.add(std::move(residue), std::move(atom), ' ');
  return true;
}

/// "NTER 4" and "GLU 4" are one residue, the glutamate.
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
    const std::string_view line = take_line(text);
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
  PdbStructure structure = residues.take();
  join_chain_ends(structure.residues);
  return structure;
}

}  // namespace tandem::server
