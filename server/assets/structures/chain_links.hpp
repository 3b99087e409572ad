// Finds bonds between the residues of chains by distance, because chain letters, numbers and TER records are often
// wrong.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// Kind of a residue's end towards a neighbour in its chain.
enum class ChainEnd {
  kBonded,  ///< bonded to a neighbour
  kEnd,     ///< the chain ends
  kGap,     ///< residues are missing: the chain continues in the file after the gap
};

struct ChainLink {
  std::optional<std::size_t> previous;  ///< residue whose C or O3' is bonded to the N or P of this one
  ChainEnd begins = ChainEnd::kEnd;
  ChainEnd ends = ChainEnd::kEnd;
};

/// Returns the links of each residue, in file order. Residues without the atoms of such a bond are bonded to the next
/// of their chain. They occur in damaged files and in files of alpha carbons.
///
/// Model   C-N and O3'-P up to 2.0 Å. The bonds are 1.33 and 1.61 Å; other pairs of these atoms are at least 2.5 Å
///         apart
std::vector<ChainLink> chain_links(const std::vector<PdbResidue>& residues);

/// Returns null if the residue has no atom of that name.
const PdbAtom* find_atom(const PdbResidue& residue, std::string_view name);

}  // namespace tandem::server
