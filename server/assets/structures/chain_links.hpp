// Finds bonds between the residues of chains by distance. Chain letters, numbers and TER records are not used, because
// in many files they are wrong.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// State of one end of a residue in its chain.
enum class ChainEnd {
  kBonded,  ///< bonded to a neighbour
  kEnd,     ///< end of the chain
  kGap,     ///< neighbouring residues are missing in the file; the chain continues after the gap
};

struct ChainLink {
  std::optional<std::size_t> previous;  ///< residue whose C (or O3') is bonded to the N (or P) of this residue
  ChainEnd begins = ChainEnd::kEnd;
  ChainEnd ends = ChainEnd::kEnd;
};

/// Returns the links of each residue, in file order. A residue without the atoms of a chain bond (N, C, P or O3') is
/// linked to the next residue of its chain. Such residues occur in damaged files, and in files with alpha carbons only.
///
/// Model   A bond is a pair C-N or O3'-P with a distance of at most 2.0 Å. Actual bond lengths are 1.33 and 1.61 Å, and
///         unbonded pairs of these atoms are at least 2.5 Å apart
std::vector<ChainLink> chain_links(const std::vector<PdbResidue>& residues);

/// Returns the atom of that name; null if the residue has none.
const PdbAtom* find_atom(const PdbResidue& residue, std::string_view name);

}  // namespace tandem::server
