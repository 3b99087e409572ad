// Reads the parameter files of a GROMACS force-field folder into data structures for residue_typing.hpp.
//
// Terms: a block is the force field's entry for a residue: a list of its atoms with types and charges (one [ entry ] of
// aminoacids.rtp). An edit changes a block at a chain end. An alias is a further name of an atom.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/docking/molecule_error.hpp"

namespace tandem::server {

/// Folder of OPLS-AA in the Debian package gromacs-data.
inline constexpr const char* kOplsDirectory = "/usr/share/gromacs/top/oplsaa.ff";
/// Name of the built-in parameters by element, which need no folder.
inline constexpr const char* kBuiltInForceField = "built-in";

/// Name of OPLS-AA. Two features are supported for this force field only: united atoms, and the use of its own atom
/// types as substitutes for missing elements.
inline constexpr std::string_view kOplsName = "oplsaa";
inline constexpr std::string_view kElementPrefix = "element ";

struct AtomType {
  double mass_u = 0;
  double sigma_angstrom = 0;
  double epsilon_kj_per_mol = 0;
};

/// One atom of a block. The same atom type may have different charges in different blocks.
struct BlockAtom {
  std::string name;
  std::string type;
  double charge_e = 0;
};

/// Rule for adding hydrogens to an atom: one line of aminoacids.hdb.
struct HydrogenRule {
  int count = 0;
  int kind = 0;      ///< kind of geometry, see hydrogen_geometry.hpp
  std::string name;  ///< name of a single hydrogen; several are numbered: HB1, HB2
  /// Names of the atoms that determine the positions: the atom that carries the hydrogens, then atoms that define
  /// directions. "-C" means the atom C of the previous residue.
  std::vector<std::string> anchors;

  std::string hydrogen(int i) const { return count == 1 ? name : name + std::to_string(i + 1); }
};

struct ResidueBlock {
  std::string name;
  std::vector<BlockAtom> atoms;
  std::string kind;  ///< "DNA" or "RNA", as in aliases; empty for a block of aminoacids.rtp

  const BlockAtom* find(std::string_view atom) const;
  bool is_amino_acid() const;  ///< whether it has N, CA, C and O
  bool is_nucleotide() const;  ///< whether it has C1' and O4' of a sugar
};

/// Names of the blocks that replace a residue's block at a chain end. A name is empty if there is no special block.
struct EndBlocks {
  std::string first;  ///< block for the N terminus, or the 5' end
  std::string last;   ///< block for the C terminus, or the 3' end
  std::string both;
};

/// Changes to a residue's block at a chain end.
struct TerminusEdit {
  /// New entries for the atoms with these names; an entry for "OXT" is added if the block lacks this atom.
  std::vector<BlockAtom> replaced;
  std::vector<BlockAtom> added;  ///< atoms to add, e.g. H1, H2, H3
  std::vector<std::string> deleted;
  std::vector<HydrogenRule> hydrogens;
};

struct AtomAlias {
  std::string residue;  ///< a residue name, "protein", "protein-nterm" or "protein-cterm"
  std::string from;
  std::string to;
};

struct ForceField {
  std::string name;       ///< name of the folder without ".ff": "oplsaa"
  std::string directory;  ///< path of the folder, for messages
  std::map<std::string, AtomType, std::less<>> types;
  std::map<std::string, ResidueBlock, std::less<>> blocks;
  std::map<std::string, std::vector<HydrogenRule>, std::less<>> hydrogens;  ///< rules by the name of their block
  std::map<std::string, TerminusEdit, std::less<>> n_termini;
  std::map<std::string, TerminusEdit, std::less<>> c_termini;
  /// Name of a residue's block, if it differs from the residue's name: LYS → LYSH.
  std::map<std::string, std::string, std::less<>> block_of_residue;
  std::map<std::string, EndBlocks, std::less<>> end_blocks;  ///< blocks at chain ends, e.g. NALA and CALA for ALA
  std::vector<AtomAlias> aliases;
  /// Names by which structure files call atoms of this force field's blocks. Here `residue` is the name of a block, a
  /// kind (as in ResidueBlock::kind), or "*" for every block.
  std::vector<AtomAlias> block_aliases;
  bool mixes_arithmetically = false;  ///< whether σ is combined by the arithmetic mean (docking::Molecule)
  /// true: an atom type is the name of an element, or "HP" for a hydrogen that is not bonded to carbon. The blocks then
  /// contain only names of residues.
  bool is_by_element = false;

  const ResidueBlock* block(std::string_view name) const;

  /// Returns the atom type with this name.
  /// Fails   MoleculeError: ffnonbonded.itp does not contain the type
  const AtomType& type(std::string_view name) const;
};

/// Returns a substitute for OPLS-AA that needs no files: Lennard-Jones parameters by element, and no charges.
///
/// Source  Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225: C, H of alkanes, N, O of amides, S of thiols, P and
///         halogens; Åqvist, J. Phys. Chem. 94 (1990) 8021: ions, with the values of magnesium for zinc and iron; other
///         elements: elements.hpp
ForceField built_in_force_field();

/// Reads a force field from these files:
/// * in its folder: forcefield.itp, ffnonbonded.itp, aminoacids.rtp, .hdb, .n.tdb, .c.tdb and .r2b;
/// * in its folder, if present: aminoacids.arn, and dna and rna with .rtp, .hdb, .r2b and .arn;
/// * in its folder or the parent folder: xlateat.dat.
///
/// A name such as "amber99sb" means the folder of that name in gromacs-data. "built-in" means built_in_force_field().
/// Types "element C" … are added as substitutes for missing entries.
///
/// Fails   MoleculeError in these cases:
///         * The folder or a file is missing; the message names the Debian package.
///         * A line cannot be read; the message names the line.
///         * The combination rule is neither 2 (arithmetic) nor 3 (geometric).
///         * The files have parameters for single pairs of atom types.
/// Cost    about 5 ms
ForceField load_force_field(const std::filesystem::path& directory_or_name);

}  // namespace tandem::server
