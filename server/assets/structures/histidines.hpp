// Chooses which nitrogen of a histidine carries the hydrogen if the file does not state it.
#pragma once

#include <string>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

struct HistidineChoice {
  std::string block;   ///< "HISD" or "HISE"; empty: not a histidine, or its ring has hydrogens
  std::string reason;  ///< for the user: "ND1 is 2.8 Å from OD1 of ASP 102"
};

/// Chooses the neutral tautomer of each of `residues`. The hydrogen is on the nitrogen with the better acceptor along
/// the bond, and not on one near a metal or a donor. Without either the choice is HISE, the usual tautomer in water.
///
/// Model   acceptors: oxygens of backbone, carboxylates, amides and phosphates up to 3.5 Å from the nitrogen and within
///         60° of the N-H bond; donors: nitrogens with hydrogens, with the same limits; metals up to 2.8 Å. Hydroxyls
///         and water can be both and do not count. The weight falls from 1 at 2.5 Å to 0 at 3.5 Å; a metal outweighs
///         all others
/// In      others  other groups nearby: ions, nucleic acids
std::vector<HistidineChoice> choose_histidines(const std::vector<PdbResidue>& residues,
                                               const std::vector<PdbResidue>& others);

}  // namespace tandem::server
