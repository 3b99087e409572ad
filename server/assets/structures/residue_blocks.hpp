// Chooses the block of a residue: its entry in the force field, a list of atoms with types and charges. The choice
// depends on the residue's name, its protonation and its chain ends. The name may follow the convention of any common
// program.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/assets/structures/chain_links.hpp"
#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

struct ResidueContext {
  std::optional<std::size_t> previous;  ///< previous residue in the chain
  ChainEnd begins = ChainEnd::kBonded;
  ChainEnd ends = ChainEnd::kBonded;
  bool in_disulfide = false;
  std::string histidine;  ///< block of a histidine whose ring has no hydrogens; empty means HISE
};

/// Names of a residue's atoms in the force field, and the heavy atoms that carry its hydrogens.
struct NamedAtoms {
  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

  std::vector<std::string> names;
  /// For each hydrogen the index of its heavy atom, or kNowhere if none is within a bond length; for other atoms their
  /// own index.
  std::vector<std::size_t> carriers;

  std::size_t hydrogens_on(std::string_view heavy) const;
};

/// Atoms and hydrogen rules of a residue, including its chain ends.
struct Composition {
  std::vector<BlockAtom> atoms;
  std::vector<HydrogenRule> rules;
};

/// Returns whether residues of this name are parts of chains: the force field has a block of this name, and it is an
/// amino acid, a cap (ACE, NAC/NME, NH2, NHE) or a nucleotide.
bool is_chain_residue(const ForceField& force_field, std::string_view residue_name);
bool is_amino_acid(const ForceField& force_field, std::string_view residue_name);
bool is_histidine(std::string_view residue_name);

/// Returns whether the force field has a block for the residue; water and ions may have one as well.
bool has_block(const ForceField& force_field, std::string_view residue_name);

/// Returns the block for a residue name of GROMACS; null if there is none. For example, "HISE" is HIE in AMBER's force
/// fields and HSE in CHARMM's.
const ResidueBlock* block_named(const ForceField& force_field, std::string_view residue);

/// Returns "HIS" for HID, HSD and other variants; returns other names unchanged.
std::string_view canonical_residue(std::string_view name);

/// Returns the names of a residue's atoms in the force field, and the heavy atoms that carry its hydrogens.
/// In      residue  residue for which has_block() is true
NamedAtoms named_atoms(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context);

/// Returns whether a chain was cut out of a longer chain before this amino acid: it is the first of its chain, but has
/// only one hydrogen on N, like a residue within a chain.
bool begins_cut(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context);

/// Chooses the block by the residue's name and the hydrogens on its atoms. If the hydrogen of a carboxyl group is on
/// the first oxygen, swaps the names of the group's oxygens in `named`.
const ResidueBlock& choose_block(const ForceField& force_field, std::string_view residue_name,
                                 const ResidueContext& context, NamedAtoms& named);

/// Returns the atoms of a residue: those of a special block for its chain end, or those of `block` with the changes at
/// its chain ends. Adapts the atom names in `named` to the result.
Composition block_with_ends(const ForceField& force_field, const ResidueBlock& block, const ResidueContext& context,
                            NamedAtoms& named);

}  // namespace tandem::server
