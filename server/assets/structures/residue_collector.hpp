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
  std::string element;  ///< see element_of()
  Vec3 position_angstrom = Vec3::Zero();
  std::optional<double> charge_e;         ///< where the format has one, PQR and PDBQT
  std::optional<double> radius_angstrom;  ///< likewise, PQR
  double occupancy = 1;
  int formal_charge_e = 0;  ///< where the file states one
};

struct PdbResidue {
  std::string name;  ///< of PDB files columns 18-21: four letters, as GROMACS and CHARMM write them
  std::string id;    ///< number and insertion code, "12A"
  std::string chain;
  int segment = 0;  ///< counts the TER records before it
  std::vector<PdbAtom> atoms;
  std::string segment_name = {};  ///< of PDB files columns 73-76; a chain's name in files without any
};

/// As in PQR and PDBQT files, whose charges are complete with the hydrogens that they have.
bool has_own_charges(const PdbResidue& residue);

struct PdbStructure {
  std::vector<PdbResidue> residues;  ///< in file order
  std::size_t alternate_atoms = 0;   ///< left out: of another alternate location than the one taken
  std::size_t duplicate_atoms = 0;   ///< left out: an atom of that name was at that place already
  bool has_more_models = false;      ///< left out: all models but the first
  std::vector<std::string> dropped;  ///< the first 100,000 of those atoms, for people
};

/// "VAL 12A of chain B", as the file has it.
std::string residue_place(const PdbResidue& residue);
/// "CG of VAL 12A of chain B", printable.
std::string place_text(const PdbResidue& residue, std::string_view atom);

/// Atoms of one chain, number and insertion code are one residue; a second residue of that number begins where the backbone begins
/// again, and where later atoms are far from the first ones. Atoms that share a name are several atoms unless they are at one place.
///
/// Of each residue one alternate location is kept, with the atoms that have none: the one of the largest mean occupancy of heavy
/// atoms, of equal ones that of most atoms. Neighbours in a chain whose bond has alternates take the same. Two residue names at one
/// place are alternates too.
/// Bounded: atoms in all, and atoms of one residue.
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
  /// One residue name at one place.
  struct OpenResidue {
    PdbResidue residue;
    std::vector<Record> records;
    std::size_t place = 0;  ///< index of the first residue at its place
    char chosen = ' ';
  };

  bool belongs_to(const OpenResidue& known, const PdbResidue& residue, const Record& record) const;
  static bool are_linked(const OpenResidue& before, const OpenResidue& after);
  void choose_alternates();
  void choose_alternate(std::size_t begin, std::size_t end);
  static bool is_only_one(const OpenResidue& open, const Record& record);
  void close(OpenResidue& open);
  void drop(const PdbResidue& residue, const Record& record, const char* why);
  void name_chains_by_segment();

  std::size_t atoms_ = 0;
  std::vector<OpenResidue> open_;
  std::unordered_map<std::string, std::size_t> index_of_place_;  ///< the latest residue there
  PdbStructure structure_;
};

/// docking::validate() allows no more.
inline constexpr double kMaxCoordinateAngstrom = 1e6, kMaxCharge_e = 100;

}  // namespace tandem::server
