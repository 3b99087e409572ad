// Hydrogens that a structure file lacks, where GROMACS's pdb2gmx puts them; and united atoms, which need none.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/assets/structures/hydrogen_relaxation.hpp"
#include "server/assets/structures/residue_typing.hpp"

namespace tandem::server {

enum class Hydrogens {
  kGiven,     ///< those of the file
  kBuild,     ///< of amino acids built anew, the file's left out
  kUnited,    ///< likewise, but on carbon they are part of it: CH, CH2, CH3
  kAsNeeded,  ///< given where the chosen chains have any, else built
};

/// "given", "build" or "united"; empty: as needed.
/// Fails   std::invalid_argument for another, naming these
Hydrogens hydrogens_of(const std::string& text);
std::string text_of(Hydrogens hydrogens);

/// Replaces the hydrogens of residues without charges of their own by those of the rules of their blocks and chain ends
/// (hydrogen_places()). A rule of which an atom is missing adds nothing.
///
/// In      residues, contexts  one a residue, in file order
std::vector<BuiltGroup> build_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                        std::span<const ResidueContext> contexts);

/// Builds what one residue lacks, beside the hydrogens that it has; of a group such as CH3 of which one is missing, all are built.
std::vector<BuiltGroup> complete_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                           std::span<const ResidueContext> contexts, std::size_t r);

/// Adds the second oxygen of a chain's last amino acid where it is missing: in the plane of CA, C and O, 1.25 Å from C.
/// Out     whether it was added
bool complete_chain_end(const ForceField& force_field, PdbResidue& residue);

/// Takes the hydrogens on carbon out of a residue and its entries; their charge and mass go to the carbon, which becomes
/// one of the force field's united atoms.
///
/// Source  Jorgensen, Tirado-Rives, JACS 110 (1988) 1657: CH, CH2, CH3 and aromatic CH, opls_005 to opls_011
void unite_hydrogens(const ForceField& force_field, PdbResidue& residue, TypedResidue& typed);

}  // namespace tandem::server
