// Hydrogens that a structure file lacks, where GROMACS's pdb2gmx puts them; and united atoms, which need none.
#pragma once

#include <span>
#include <vector>

#include "server/assets/structures/residue_typing.hpp"

namespace tandem::server {

enum class Hydrogens {
  kGiven,   ///< those of the file
  kBuild,   ///< of amino acids built anew, the file's left out
  kUnited,  ///< likewise, but on carbon they are part of it: CH, CH2, CH3
};

/// "given", "build" or "united".
/// Fails   std::invalid_argument for another, naming these
Hydrogens hydrogens_of(const std::string& text);

/// The residues without their hydrogens and then with those of the rules of their blocks and chain ends. A rule of which
/// an atom is missing, or farther than a bond from the one before, adds nothing.
///
/// Model   1.0 Å from their atom i, as aminoacids.hdb's rules say. With neighbours j, k, l of i: kind 1 and 5 away from
///         their mean; 6 two in the plane across j-i-k, 109.5° apart; 2 and 4 at 109.5° to i-j, first trans to k;
///         3 two at 120° to i-j, in its plane with k
/// Source  GROMACS 2022 reference manual, "Hydrogen database"
/// In      residues, contexts  one a residue, in file order
void build_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                     std::span<const ResidueContext> contexts);

/// Takes the hydrogens on carbon out of a residue and its entries; their charge and mass go to the carbon, which becomes
/// one of the force field's united atoms.
///
/// Source  Jorgensen, Tirado-Rives, JACS 110 (1988) 1657: CH, CH2, CH3 and aromatic CH, opls_005 to opls_011
void unite_hydrogens(const ForceField& force_field, PdbResidue& residue, TypedResidue& typed);

}  // namespace tandem::server
