// Sorts the atoms that a reader finds into residues, and chooses among alternate locations.
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
  std::string name;     ///< name in the file: "CA", "1HB"
  std::string element;  ///< symbol as returned by element_of()
  Vec3 position_angstrom = Vec3::Zero();
  std::optional<double> charge_e;         ///< charge, if the format has one (PQR, PDBQT)
  std::optional<double> radius_angstrom;  ///< radius, if the format has one (PQR)
  double occupancy = 1;
  int formal_charge_e = 0;  ///< formal charge; 0 if the file has none
};

struct PdbResidue {
  std::string name;  ///< name of up to four letters; in PDB files columns 18-21
  std::string id;    ///< number and insertion code, "12A"
  std::string chain;
  int segment = 0;  ///< number of TER records before the residue
  std::vector<PdbAtom> atoms;
  std::string segment_name = {};  ///< name in columns 73-76 of a PDB file; replaces missing chain names
};

/// Returns whether the file states charges for the atoms, as PQR and PDBQT files do. These files are complete with
/// their own hydrogens, so no hydrogens are added.
bool has_own_charges(const PdbResidue& residue);

struct PdbStructure {
  std::vector<PdbResidue> residues;  ///< residues in file order
  std::size_t alternate_atoms = 0;   ///< number of atoms omitted because they are at other alternate locations
  std::size_t duplicate_atoms = 0;   ///< number of atoms omitted because an atom of that name is at the same position
  bool has_more_models = false;      ///< whether the file has further models, which are ignored
  std::vector<std::string> dropped;  ///< descriptions of the first 100,000 omitted atoms, for the user
};

/// Formats a residue, e.g. "VAL 12A of chain B", with the names in the file.
std::string residue_place(const PdbResidue& residue);
/// Formats an atom, e.g. "CG of VAL 12A of chain B", with printable characters only.
std::string place_text(const PdbResidue& residue, std::string_view atom);

/// Sorts atoms into residues by chain, number and insertion code.
///
/// * New residue: atoms with the same number begin a second residue if backbone atoms repeat, or if the later atoms are
///   far from the first ones.
/// * Equal names: atoms of a residue with the same name are different atoms, unless they are at one position.
/// * Alternate locations: for each residue, the location with the largest mean occupancy of heavy atoms is chosen;
///   among equals, the one with the most atoms. Atoms without an alternate location are always kept.
/// * Neighbours: two residues get the same location if the bond between them has alternate locations.
/// * Alternate names: two residue names at one position are alternates as well.
/// * Bounds: the number of atoms is limited, in total and in one residue.
class ResidueCollector {
 public:
  /// Adds the next atom of the file to its residue.
  /// In      residue    residue of the atom, without atoms
  ///         alternate  letter of the alternate location; ' ' if there is none
  /// Fails   MoleculeError: more than 1,000,000 atoms
  void add(PdbResidue residue, PdbAtom atom, char alternate);
  std::size_t atom_count() const { return atoms_; }
  PdbStructure finish();

 private:
  struct Record {
    PdbAtom atom;
    char alternate = ' ';
  };
  /// Atoms with one residue name at one place in the sequence, i.e. with one chain and one residue number.
  struct OpenResidue {
    PdbResidue residue;
    std::vector<Record> records;
    std::size_t place = 0;  ///< index of the first opened residue at this place
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
  std::unordered_map<std::string, std::size_t> index_of_place_;  ///< index of the last opened residue at each place
  PdbStructure structure_;
};

/// Largest magnitudes that docking::validate() allows.
inline constexpr double kMaxCoordinateAngstrom = 1e6, kMaxCharge_e = 100;

}  // namespace tandem::server
