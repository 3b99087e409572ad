// The choice of a force field's block for a residue, by its name under any program's convention, its protonation and its chain ends.
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
  std::optional<std::size_t> previous;  ///< in its chain
  ChainEnd begins = ChainEnd::kBonded;
  ChainEnd ends = ChainEnd::kBonded;
  bool in_disulfide = false;
  std::string histidine;  ///< the block of one without hydrogens on its ring; empty: HISE
};

/// The names of a residue's atoms as the force field has them, and what carries its hydrogens.
struct NamedAtoms {
  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

  std::vector<std::string> names;
  /// Of each hydrogen the heavy atom that it is on, kNowhere where none is within a bond; of other atoms themselves.
  std::vector<std::size_t> carriers;

  std::size_t hydrogens_on(std::string_view heavy) const;
};

/// What a residue is made of, with its chain ends.
struct Composition {
  std::vector<BlockAtom> atoms;
  std::vector<HydrogenRule> rules;
};

/// Whether residues of this name are parts of chains: the force field has a block of an amino acid, a cap (ACE, NAC/NME, NH2, NHE) or a
/// nucleotide for it.
bool is_chain_residue(const ForceField& force_field, std::string_view residue_name);
bool is_amino_acid(const ForceField& force_field, std::string_view residue_name);
bool is_histidine(std::string_view residue_name);

/// Whether the force field has any block for it: also water, ions.
bool has_block(const ForceField& force_field, std::string_view residue_name);

/// The block of a residue as GROMACS names it: "HISE" is HIE in AMBER's force fields, HSE in CHARMM's. Null: none.
const ResidueBlock* block_named(const ForceField& force_field, std::string_view residue);

/// "HIS" of HID, HSD …; other names as they are.
std::string_view canonical_residue(std::string_view name);

/// In      residue  one for which has_block()
NamedAtoms named_atoms(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context);

/// Whether an amino acid begins its chain with the one hydrogen on N that it has within a chain: it was cut out of a longer one.
bool begins_cut(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context);

/// By the residue's name and the hydrogens on its atoms. `named`: an acid's oxygens change names where the hydrogen is on the first.
const ResidueBlock& choose_block(const ForceField& force_field, std::string_view residue_name,
                                 const ResidueContext& context, NamedAtoms& named);

/// The block with the edits of its chain ends, or the block that an end has of its own; `named` gets its names of atoms.
Composition block_with_ends(const ForceField& force_field, const ResidueBlock& block, const ResidueContext& context,
                            NamedAtoms& named);

}  // namespace tandem::server
