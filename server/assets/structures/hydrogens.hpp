// Adds hydrogens that a structure file lacks, at the positions that GROMACS's pdb2gmx would choose. It also merges
// carbons with their hydrogens to united atoms.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/assets/structures/hydrogen_relaxation.hpp"
#include "server/assets/structures/residue_typing.hpp"

namespace tandem::server {

enum class Hydrogens {
  kGiven,     ///< the hydrogens of the file are used
  kBuild,     ///< all hydrogens of amino acids are built, and those of the file are discarded
  kUnited,    ///< all hydrogens are built, then a carbon and its hydrogens become one united atom: CH, CH2, CH3
  kAsNeeded,  ///< kGiven if the chosen chains have any hydrogens, otherwise kBuild
};

/// Parses "given", "build" or "united". Empty text means kAsNeeded.
/// Fails   std::invalid_argument: any other text; the message lists the valid ones
Hydrogens hydrogens_of(const std::string& text);
std::string text_of(Hydrogens hydrogens);

/// Replaces the hydrogens of each residue, unless the file states charges for its atoms. The new hydrogens follow the
/// rules of the residue's block (its entry in the force field) and of its chain ends (hydrogen_places()). If an atom
/// that a rule needs is missing, the rule adds nothing.
///
/// In      residues, contexts  one context for each residue, in file order
std::vector<BuiltGroup> build_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                        std::span<const ResidueContext> contexts);

/// Adds the missing hydrogens of residue `r`. If a group such as CH3 is incomplete, all of its hydrogens are built
/// again.
std::vector<BuiltGroup> complete_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                           std::span<const ResidueContext> contexts, std::size_t r);

/// Adds the oxygen OXT to the last amino acid of a chain if it is missing. It is placed in the plane of CA, C and O,
/// 1.25 Å from C.
/// Out     true if the oxygen was added
bool complete_chain_end(const ForceField& force_field, PdbResidue& residue);

/// Merges each carbon of a residue with its hydrogens to a united atom. The hydrogens are removed from the residue and
/// from `typed`, and their charge and mass are added to the carbon. The carbon gets the force field's type for such a
/// united atom.
///
/// Source  Jorgensen, Tirado-Rives, JACS 110 (1988) 1657: CH, CH2, CH3 and aromatic CH, opls_005 to opls_011
void unite_hydrogens(const ForceField& force_field, PdbResidue& residue, TypedResidue& typed);

}  // namespace tandem::server
