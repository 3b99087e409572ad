// Atoms as readers meet them, sorted into residues; chooses among alternate locations.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/docking/molecule_error.hpp"

namespace tandem::server {

struct PdbAtom {
  std::string name;     ///< as in the file: "CA", "1HB"
  std::string element;  ///< upper case: "C", "ZN"
  Vec3 position_angstrom = Vec3::Zero();
  std::optional<double> charge_e;         ///< where the format has one, PQR
  std::optional<double> radius_angstrom;  ///< likewise
};

struct PdbResidue {
  std::string name;  ///< of PDB files columns 18-21: four letters, as GROMACS and CHARMM write them
  std::string id;    ///< number and insertion code, "12A"
  std::string chain;
  int segment = 0;  ///< counts the TER records before it
  std::vector<PdbAtom> atoms;
};

struct PdbStructure {
  std::vector<PdbResidue> residues;  ///< in file order
  std::size_t alternate_atoms = 0;   ///< left out: of another alternate location than the first
  std::size_t duplicate_atoms = 0;   ///< left out: name and residue were there already
  bool has_more_models = false;      ///< left out: all models but the first
  std::vector<std::string> dropped;  ///< the first 100,000 of those atoms, for people
};

/// "CG of VAL 12A of chain B", printable.
std::string place_text(const PdbResidue& residue, std::string_view atom);

/// From a name or a type: 'FE' is iron only where the file's own column for it says so too or the residue is that ion;
/// otherwise the first letter, right for all elements of proteins but selenium. Deuterium is a hydrogen.
std::string element_of(std::string_view atom_name, std::string_view file_element, std::string_view residue_name);

/// Of each residue the first alternate location is kept, and of an atom that it lacks the first one given; of two
/// residue names at one place the first. Bounded: atoms in all, and atoms of one residue.
class ResidueCollector {
 public:
  /// Fails   MoleculeError: more than 1,000,000 atoms
  void add(PdbResidue residue, PdbAtom atom, char alternate);
  std::size_t atom_count() const { return atoms_; }
  PdbStructure take();

 private:
  struct Record {
    PdbAtom atom;
    char alternate = ' ';
  };
  struct OpenResidue {
    PdbResidue residue;
    std::vector<Record> records;
  };
  void close(OpenResidue& open);
  void drop(const PdbResidue& residue, const Record& record, const char* why);

  std::size_t atoms_ = 0;
  std::vector<OpenResidue> open_;
  std::unordered_map<std::string, std::size_t> index_of_place_;
  PdbStructure structure_;
};

inline constexpr double kMaxCoordinateAngstrom = 1e6;  ///< docking::validate() allows no more

}  // namespace tandem::server
