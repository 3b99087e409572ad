// Which force-field entry each atom of a residue gets: protonation variant, chain end, and the many names that
// programs give to the same hydrogen.
//
// Order of decisions
//   1. names        digit first to digit last (1HB → HB1), the aliases of xlateat.dat, names of caps and variants
//   2. block        by residue name; HIS, LYS, ASP, GLU by the hydrogens on their atoms; CYS by its disulfide
//   3. chain ends   by the hydrogens on N and by OXT; without hydrogens the charged end
//   4. atoms        heavy ones by name; a hydrogen by the atom that it is on, whatever its name
//   5. the rest     by element, charge 0, named as guessed
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
  std::vector<BlockAtom> atoms;             ///< the entry of each of the residue's
  std::vector<std::string> names;           ///< likewise: as the force field calls it, for hydrogens.hpp
  std::vector<HydrogenRule> rules;          ///< of the block and its chain ends
  std::vector<std::string> guesses;         ///< likewise: empty for an exact entry; else for people
  std::optional<double> expected_charge_e;  ///< of all atoms that the block has; none: no block
  std::size_t expected_hydrogens = 0;
  std::size_t missing_hydrogens = 0;
  std::vector<std::string> missing_heavy;  ///< names
  std::vector<std::string> missing_hydrogen_names;
  std::vector<std::size_t> misfits;  ///< hydrogens that are on no atom, or one too many on theirs
};

/// Source  block and chain-end choice follow pdb2gmx (GROMACS manual, "gmx pdb2gmx"); the fallbacks are ours
/// In      residue  one for which has_block()
TypedResidue type_residue(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context);

/// Of a residue whose side chain the file has in part: shifts the charges of its side chain's atoms alike so that the residue has a whole
/// charge, the nearest. Out: that charge; nothing: the residue is complete.
std::optional<double> make_whole(const PdbResidue& residue, TypedResidue& typed);

/// Every atom by its element: a ligand, an ion, a sugar, which the force field does not know; a guess, unless the force
/// field is by element.
TypedResidue type_by_element(const ForceField& force_field, const PdbResidue& residue);

/// For each residue whether its SG is bonded to another's.
///
/// Source  GROMACS's specbond.dat: SG-SG 0.2 nm, and pdb2gmx's tolerance of 10 %
/// Fails   MoleculeError: more than 20,000 of them
std::vector<bool> find_disulfides(const std::vector<PdbResidue>& residues);

}  // namespace tandem::server
