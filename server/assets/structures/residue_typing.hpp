// Assigns force-field entries to the atoms of a residue. Takes into account protonation variants, chain ends, and the
// different names that programs give to the same hydrogen. A block is the force field's entry for a residue.
//
// The decisions are made in this order:
//   1. Names: a leading digit is moved to the end (1HB → HB1). The aliases of xlateat.dat and the names of caps and
//      variants are replaced.
//   2. Block: it is chosen by the residue name. HIS, LYS, ASP and GLU depend on the hydrogens on their atoms as well,
//      CYS on its disulfide bond.
//   3. Chain ends: they are chosen by the hydrogens on N and by OXT. Without hydrogens, the charged end is chosen.
//   4. Atoms: heavy atoms are matched by name. A hydrogen is matched by its heavy atom, under any name.
//   5. All other atoms: they get an entry by their element with charge 0, and are reported as guessed.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/residue_blocks.hpp"
#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

struct TypedResidue {
  std::vector<BlockAtom> atoms;             ///< entries, parallel to the residue's atoms
  std::vector<std::string> names;           ///< parallel to `atoms`: names in the force field, for hydrogens.hpp
  std::vector<HydrogenRule> rules;          ///< rules of the block and its chain ends
  std::vector<std::string> guesses;         ///< parallel to `atoms`: explanations for the user; empty if not guessed
  std::optional<double> expected_charge_e;  ///< sum over all atoms of the block; nothing if there is no block
  std::size_t expected_hydrogens = 0;
  std::size_t missing_hydrogens = 0;
  std::vector<std::string> missing_heavy;  ///< names of missing heavy atoms
  std::vector<std::string> missing_hydrogen_names;
  std::vector<std::size_t> misfits;  ///< indices of hydrogens without a heavy atom, or surplus on their heavy atom
};

/// Assigns an entry of the force field to each atom of a residue, by the decisions above.
///
/// Source  choice of block and chain ends: pdb2gmx (GROMACS manual, "gmx pdb2gmx"); the entries by element for other
///         atoms were chosen for this project
/// In      residue  residue for which has_block() is true
TypedResidue type_residue(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context);

/// Makes the charge of a residue with an incomplete side chain a whole number, the nearest one. The charges of the side
/// chain's atoms are changed by equal amounts.
/// Out     the new charge; nothing if the residue is complete
std::optional<double> make_whole(const PdbResidue& residue, TypedResidue& typed);

/// Assigns an entry by its element to every atom of a ligand, ion or sugar that the force field lacks. Each entry
/// counts as a guess, unless the force field has only entries by element.
TypedResidue type_by_element(const ForceField& force_field, const PdbResidue& residue);

/// Returns for each residue whether its SG is bonded to another SG.
///
/// Source  GROMACS's specbond.dat: SG-SG distance 0.2 nm, and pdb2gmx's tolerance of 10 %
/// Fails   MoleculeError: there are more than 20,000 cysteines
std::vector<bool> find_disulfides(const std::vector<PdbResidue>& residues);

}  // namespace tandem::server
