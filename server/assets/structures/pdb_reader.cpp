// Fixed columns of the PDB format 3.3, https://www.wwpdb.org/documentation/file-format-content/format33/sect9.html:
//
//    1-6 record   13-16 name   17 alternate location   18-20 residue   22 chain   23-26 number
//   27 insertion code   31-38, 39-46, 47-54 x y z [Å]   77-78 element
//
// Everything is bounded, because any bytes may come: file size (structure_file.hpp), atoms, atoms of one residue.
#include "server/assets/structures/pdb_reader.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kLastCoordinateColumn = 54;

class PdbParser {
 public:
  explicit PdbParser(const std::string& source) : source_(source) {}

  PdbStructure parse(std::string_view text);

 private:
  [[noreturn]] void fail(const std::string& what) const;
  double coordinate(std::string_view line, std::size_t first, std::size_t last, char axis) const;
  void add_atom(std::string_view line);

  const std::string& source_;
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

void PdbParser::add_atom(std::string_view line) {
  // A number cut off in the middle would still be a number.
  if (line.size() < kLastCoordinateColumn) {
    fail("atom line ends at column " + std::to_string(line.size()) +
         ", within the coordinates in columns 31-54; complete or delete this line");
  }
  PdbResidue residue;
  residue.name = columns(line, 18, 21);
  residue.chain = columns(line, 22, 22);
  residue.id = columns(line, 23, 27);
  residue.segment = segment_;
  PdbAtom atom;
  atom.name = columns(line, 13, 16);
  atom.element = element_of(atom.name, columns(line, 77, 78), residue.name);
  atom.position_angstrom = {coordinate(line, 31, 38, 'x'), coordinate(line, 39, 46, 'y'),
                            coordinate(line, 47, 54, 'z')};
  try {
    residues_.add(std::move(residue), std::move(atom), line[16]);
  } catch (const docking::MoleculeError& error) {
    fail(error.what());
  }
}

PdbStructure PdbParser::parse(std::string_view text) {
  bool has_more_models = false;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
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
  PdbStructure structure = residues_.take();
  structure.has_more_models = has_more_models;
  return structure;
}

}  // namespace

PdbStructure parse_pdb(std::string_view text, const std::string& source) {
  return PdbParser(source).parse(text);
}

}  // namespace tandem::server
