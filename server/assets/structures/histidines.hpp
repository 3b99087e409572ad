// Which nitrogen of a histidine carries the hydrogen where the file does not say.
#pragma once

#include <string>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

struct HistidineChoice {
  std::string block;   ///< "HISD" or "HISE"; empty: no histidine, or its ring has hydrogens
  std::string reason;  ///< for people: "ND1 is 2.8 Å from OD1 of ASP 102"
};

/// Of each of `residues`, neutral: the hydrogen is on the nitrogen with the better acceptor in the way of the bond, and not on one that a
/// metal or a donor is near. Without either HISE, the usual tautomer in water.
///
/// Model   acceptors: oxygens of backbone, carboxylates, amides and phosphates up to 3.5 Å from the nitrogen and within 60° of the
///         N-H bond; donors: nitrogens with hydrogens, likewise; metals up to 2.8 Å. Hydroxyls and water can be both and do not count.
///         Each counts by 1 at 2.5 Å down to 0 at 3.5 Å; a metal more than all others
/// In      others  what else is near: ions, nucleic acids
std::vector<HistidineChoice> choose_histidines(const std::vector<PdbResidue>& residues,
                                               const std::vector<PdbResidue>& others);

}  // namespace tandem::server
