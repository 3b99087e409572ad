// Adds hydrogens that a structure file lacks, at the positions of GROMACS's pdb2gmx. Also makes united atoms, which
// need none.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/assets/structures/hydrogen_relaxation.hpp"
#include "server/assets/structures/residue_typing.hpp"

namespace tandem::server {

enum class Hydrogens {
  kGiven,     ///< hydrogens of the file
  kBuild,     ///< hydrogens of amino acids are built anew; those of the file are left out
  kUnited,    ///< like kBuild, but hydrogens on carbon are part of it: CH, CH2, CH3
  kAsNeeded,  ///< given if the chosen chains have any, else built
};

/// Parses "given", "build" or "united"; empty means as needed.
/// Fails   std::invalid_argument for any other text; the message lists these
Hydrogens hydrogens_of(const std::string& text);
std::string text_of(Hydrogens hydrogens);

/// Replaces the hydrogens of residues without charges of their own by the hydrogens of the rules of their blocks and
/// chain ends (hydrogen_places()). A rule with a missing atom adds nothing.
///
/// In      residues, contexts  one context for each residue, in file order
std::vector<BuiltGroup> build_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                        std::span<const ResidueContext> contexts);

/// Adds the missing hydrogens of one residue. If a group such as CH3 lacks one hydrogen, all of its hydrogens are
/// built.
std::vector<BuiltGroup> complete_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                           std::span<const ResidueContext> contexts, std::size_t r);

/// Adds the second oxygen of a chain's last amino acid where it is missing: in the plane of CA, C and O, 1.25 Å from C.
/// Out     whether the oxygen was added
bool complete_chain_end(const ForceField& force_field, PdbResidue& residue);

/// Removes the hydrogens on carbon from a residue and its entries. Their charge and mass are added to the carbon, which
/// becomes one of the force field's united atoms.
///
/// Source  Jorgensen, Tirado-Rives, JACS 110 (1988) 1657: CH, CH2, CH3 and aromatic CH, opls_005 to opls_011
void unite_hydrogens(const ForceField& force_field, PdbResidue& residue, TypedResidue& typed);

}  // namespace tandem::server
