// The parameter files of a GROMACS force-field folder, as data: what residue_typing.hpp chooses from.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/docking/molecule_error.hpp"

namespace tandem::server {

/// OPLS-AA of the Debian package gromacs-data.
inline constexpr const char* kOplsDirectory = "/usr/share/gromacs/top/oplsaa.ff";
/// In place of a folder: parameters by element, which need no file.
inline constexpr const char* kBuiltInForceField = "built-in";

/// The one of which stand-ins by element and united atoms are types of its own.
inline constexpr std::string_view kOplsName = "oplsaa";
inline constexpr std::string_view kElementPrefix = "element ";

struct AtomType {
  double mass_u = 0;
  double sigma_angstrom = 0;
  double epsilon_kj_per_mol = 0;
};

/// One atom of a residue block: the charge is the block's, not the type's.
struct BlockAtom {
  std::string name;
  std::string type;
  double charge_e = 0;
};

/// How hydrogens are added to an atom: one line of aminoacids.hdb.
struct HydrogenRule {
  int count = 0;
  int kind = 0;                      ///< the geometry: hydrogens.hpp
  std::string name;                  ///< of one hydrogen; more are numbered: HB1, HB2
  std::vector<std::string> anchors;  ///< the atom that carries them, and those that give the directions; "-C": of the
                                     ///< residue before

  std::string hydrogen(int i) const { return count == 1 ? name : name + std::to_string(i + 1); }
};

struct ResidueBlock {
  std::string name;
  std::vector<BlockAtom> atoms;
  std::string kind;  ///< of its file, as aliases name it: "DNA", "RNA"; empty: of aminoacids.rtp

  const BlockAtom* find(std::string_view atom) const;
  bool is_amino_acid() const;  ///< has N, CA, C and O
  bool is_nucleotide() const;  ///< has a sugar's C1' and O4'
};

/// Blocks that replace another at an end of its chain; empty: none does.
struct EndBlocks {
  std::string first;  ///< N terminus, or 5'
  std::string last;   ///< C terminus, or 3'
  std::string both;
};

/// What a chain end changes in the block of its residue.
struct TerminusEdit {
  std::vector<BlockAtom> replaced;  ///< by name; an atom that the block lacks is one the end brings along ("OXT")
  std::vector<BlockAtom> added;     ///< H1, H2, H3 …
  std::vector<std::string> deleted;
  std::vector<HydrogenRule> hydrogens;
};

struct AtomAlias {
  std::string residue;  ///< a residue name, "protein", "protein-nterm" or "protein-cterm"
  std::string from;
  std::string to;
};

struct ForceField {
  std::string name;       ///< the folder without ".ff": "oplsaa"
  std::string directory;  ///< for messages
  std::map<std::string, AtomType, std::less<>> types;
  std::map<std::string, ResidueBlock, std::less<>> blocks;
  std::map<std::string, std::vector<HydrogenRule>, std::less<>> hydrogens;  ///< by block
  std::map<std::string, TerminusEdit, std::less<>> n_termini;
  std::map<std::string, TerminusEdit, std::less<>> c_termini;
  std::map<std::string, std::string, std::less<>> block_of_residue;  ///< where the names differ: LYS → LYSH
  std::map<std::string, EndBlocks, std::less<>> end_blocks;          ///< ALA → NALA, CALA
  std::vector<AtomAlias> aliases;
  std::vector<AtomAlias>
      block_aliases;  ///< to the names of this force field's blocks; residue: a block, a kind of blocks, or "*"
  bool mixes_arithmetically = false;  ///< see docking::Molecule
  bool is_by_element =
      false;  ///< types are elements, and "HP", a hydrogen that is not on carbon; blocks only name residues

  const ResidueBlock* block(std::string_view name) const;

  /// Fails   MoleculeError: type not in ffnonbonded.itp
  const AtomType& type(std::string_view name) const;
};

/// What stands in for OPLS-AA without its files: Lennard-Jones parameters by element, no charges.
///
/// Source  of other elements elements.hpp; else Jorgensen, Maxwell, Tirado-Rives, JACS 118 (1996) 11225: C, H of alkanes, N, O of amides, S of thiols; P, halogens of
///         the same set; ions of Åqvist, J. Phys. Chem. 94 (1990) 8021, with zinc and iron as magnesium
ForceField built_in_force_field();

/// Reads forcefield.itp, ffnonbonded.itp, aminoacids.rtp, .hdb, .n.tdb, .c.tdb, .r2b and, where it has one, .arn of the folder,
/// likewise .rtp, .hdb, .r2b and .arn of dna and rna, and xlateat.dat of it or of its parent. A name stands for that folder of
/// gromacs-data: "amber99sb". Types "element C" … are added: what stands in for atoms without an entry. In place of a folder
/// "built-in": built_in_force_field().
///
/// Fails   MoleculeError: folder or file missing (names the Debian package), a line that cannot be read (names it), a
///         combination rule other than 2, arithmetic, and 3, geometric, or parameters of single pairs of types
/// Cost    about 5 ms
ForceField load_force_field(const std::filesystem::path& directory_or_name);

}  // namespace tandem::server
