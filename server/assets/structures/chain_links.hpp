// Which residues of a structure are bonded to which in a chain, by distance: letters of chains, numbers and TER records often say otherwise.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// What a residue has in place of a neighbour in its chain.
enum class ChainEnd {
  kBonded,  ///< a neighbour
  kEnd,     ///< the chain ends
  kGap,     ///< residues are missing: the file's chain goes on behind it
};

struct ChainLink {
  std::optional<std::size_t> previous;  ///< the residue whose C or O3' is bonded to this one's N or P
  ChainEnd begins = ChainEnd::kEnd;
  ChainEnd ends = ChainEnd::kEnd;
};

/// The links of each residue, in file order. Residues without the atoms of such a bond, of which files of alpha carbons or damaged ones
/// consist, are bonded to the next of their chain.
///
/// Model   C-N and O3'-P up to 2.0 Å: the bonds are 1.33 and 1.61 Å, and no other two atoms of these are nearer than 2.5 Å
std::vector<ChainLink> chain_links(const std::vector<PdbResidue>& residues);

/// Null: the residue has no atom of that name.
const PdbAtom* find_atom(const PdbResidue& residue, std::string_view name);

}  // namespace tandem::server
