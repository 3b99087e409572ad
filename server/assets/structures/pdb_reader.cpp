// Fixed columns of the PDB format 3.3, https://www.wwpdb.org/documentation/file-format-content/format33/sect9.html:
//
//    1-6 record   13-16 name   17 alternate location   18-20 residue   22 chain   23-26 number
//   27 insertion code   31-38, 39-46, 47-54 x y z [Å]   77-78 element
//
// Everything is bounded, because any bytes may come: file size, atoms, and atoms collected for one residue.
#include "server/assets/structures/pdb_reader.hpp"

#include <cmath>
#include <cstdint>
#include <fstream>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{256} << 20;
constexpr std::size_t kMaxAtoms = 1'000'000;
constexpr double kMaxCoordinateAngstrom = 1e6;  // validate() allows no more
constexpr std::size_t kLastCoordinateColumn = 54;
/// More records than any residue has with all its alternate locations; then a new residue begins.
constexpr std::size_t kMaxRecordsPerResidue = 1000;

struct Record {
  PdbAtom atom;
  char alternate = ' ';
};

struct OpenResidue {
  PdbResidue residue;
  std::vector<Record> records;
};

bool is_letter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

/// The first letter of the name, right for all elements of proteins but selenium; old files have other things in
/// columns 77-78, so these only confirm selenium. Deuterium is a hydrogen.
std::string element_of(std::string_view name, std::string_view columns_77_78) {
  while (!name.empty() && !is_letter(name.front())) name.remove_prefix(1);
  std::string_view element = name.substr(0, 1);
  if (columns_77_78 == "SE" && name.starts_with(columns_77_78)) element = columns_77_78;
  return std::string(element == "D" ? "H" : element);
}

class Parser {
 public:
  explicit Parser(const std::string& source) : source_(source) {}

  PdbStructure parse(std::string_view text);

 private:
  [[noreturn]] void fail(const std::string& what) const;
  double coordinate(std::string_view line, std::size_t first, std::size_t last, char axis) const;
  void add_atom(std::string_view line);
  void add_record(PdbResidue residue, Record record);
  void close(OpenResidue& open);

  const std::string& source_;
  std::size_t line_ = 0;
  std::size_t atoms_ = 0;
  int segment_ = 0;
  std::vector<OpenResidue> open_;
  std::unordered_map<std::string, std::size_t> index_of_place_;
  PdbStructure structure_;
};

void Parser::fail(const std::string& what) const {
  throw docking::MoleculeError(source_ + ":" + std::to_string(line_) + ": " + what);
}

double Parser::coordinate(std::string_view line, std::size_t first, std::size_t last, char axis) const {
  const std::string_view field = columns(line, first, last);
  double value = 0;
  if (!parse_finite(field, value) || std::abs(value) > kMaxCoordinateAngstrom) {
    fail(std::string("coordinate ") + axis + " in columns " + std::to_string(first) + "-" + std::to_string(last) +
         " is " + quoted_text(field) + ", not a number within 1e6 Å; correct or delete this line");
  }
  return value;
}

void Parser::add_atom(std::string_view line) {
  if (++atoms_ > kMaxAtoms) fail("more than 1000000 atoms; keep only the chains that are needed");
  // A number cut off in the middle would still be a number.
  if (line.size() < kLastCoordinateColumn) {
    fail("atom line ends at column " + std::to_string(line.size()) +
         ", within the coordinates in columns 31-54; complete or delete this line");
  }
  Record record;
  record.atom.name = columns(line, 13, 16);
  record.atom.element = element_of(record.atom.name, columns(line, 77, 78));
  record.alternate = line.size() >= 17 ? line[16] : ' ';
  record.atom.position_angstrom = {coordinate(line, 31, 38, 'x'), coordinate(line, 39, 46, 'y'),
                                   coordinate(line, 47, 54, 'z')};
  PdbResidue residue;
  residue.name = columns(line, 18, 21);
  residue.chain = columns(line, 22, 22);
  residue.id = columns(line, 23, 27);
  residue.segment = segment_;
  add_record(std::move(residue), std::move(record));
}

void Parser::add_record(PdbResidue residue, Record record) {
  const std::string place = std::to_string(residue.segment) + '|' + residue.chain + '|' + residue.id;
  const auto [entry, is_new] = index_of_place_.try_emplace(place, open_.size());
  if (!is_new) {
    OpenResidue& known = open_[entry->second];
    const bool other_name = known.residue.name != residue.name;
    if (other_name && record.alternate != ' ') {
      ++structure_.alternate_atoms;
      return;
    }
    if (!other_name && known.records.size() < kMaxRecordsPerResidue) {
      known.records.push_back(std::move(record));
      return;
    }
    entry->second = open_.size();
  }
  open_.push_back({std::move(residue), {}});
  open_.back().records.push_back(std::move(record));
}

/// Chooses among the alternate locations; the order of first appearance is kept.
void Parser::close(OpenResidue& open) {
  char chosen = ' ';
  for (const Record& record : open.records) {
    if (chosen == ' ') chosen = record.alternate;
  }
  const auto is_first_choice = [chosen](char alternate) { return alternate == ' ' || alternate == chosen; };
  std::unordered_map<std::string, std::pair<std::size_t, char>> kept;
  std::vector<PdbAtom>& atoms = open.residue.atoms;
  for (Record& record : open.records) {
    const auto [entry, is_new] = kept.try_emplace(record.atom.name, atoms.size(), record.alternate);
    if (is_new) {
      atoms.push_back(std::move(record.atom));
      continue;
    }
    auto& [index, alternate] = entry->second;
    if (!is_first_choice(alternate) && is_first_choice(record.alternate)) {
      atoms[index] = std::move(record.atom);
      alternate = record.alternate;
      ++structure_.alternate_atoms;
    } else {
      ++(record.alternate == alternate ? structure_.duplicate_atoms : structure_.alternate_atoms);
    }
  }
  structure_.residues.push_back(std::move(open.residue));
}

PdbStructure Parser::parse(std::string_view text) {
  if (text.starts_with("\x1f\x8b") || text.starts_with("BZh") || text.starts_with("PK")) {
    throw docking::MoleculeError(source_ + ": compressed; unpack it first, e.g. with gunzip");
  }
  if (text.starts_with("data_")) {
    throw docking::MoleculeError(source_ + ": mmCIF, which is not read here; take the PDB format of the same entry");
  }
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    ++line_;
    const std::string_view record = columns(line, 1, 6);
    if (record == "ATOM" || record == "HETATM") {
      add_atom(line);
    } else if (record == "TER") {
      ++segment_;
    } else if (atoms_ > 0 && (record == "ENDMDL" || record == "END" || record == "MODEL")) {
      structure_.has_more_models = text.find("\nATOM") != std::string_view::npos || text.starts_with("ATOM");
      break;
    }
  }
  for (OpenResidue& open : open_) close(open);
  return std::move(structure_);
}

}  // namespace

PdbStructure parse_pdb(std::string_view text, const std::string& source) {
  return Parser(source).parse(text);
}

PdbStructure read_pdb(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw docking::MoleculeError(path.string() + ": no such file; give the path of a structure in PDB format");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > kMaxBytes) {
    throw docking::MoleculeError(path.string() + ": larger than 256 MiB; keep only the chains that are needed");
  }
  std::ifstream file(path, std::ios::binary);
  std::string text(static_cast<std::size_t>(size), '\0');
  if (!file.read(text.data(), static_cast<std::streamsize>(text.size()))) {
    throw docking::MoleculeError(path.string() + ": cannot be read; check its permissions");
  }
  return parse_pdb(text, path.string());
}

}  // namespace tandem::server
