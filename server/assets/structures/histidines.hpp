// Chooses which nitrogen of a histidine carries the hydrogen, if the file does not state it.
#pragma once

#include <string>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

struct HistidineChoice {
  std::string block;   ///< "HISD" or "HISE"; empty if the residue is no histidine, or if its ring has hydrogens
  std::string reason;  ///< reason for the user: "ND1 is 2.8 Å from OD1 of ASP 102"
};

/// Chooses the neutral tautomer of each histidine in `residues`, i.e. the nitrogen of its ring that carries the
/// hydrogen. It is the nitrogen with the better acceptor in the direction of the N-H bond, but never one near a metal
/// or a donor. Without such neighbours the choice is HISE, the usual tautomer in water.
///
/// Model   Neighbours that affect the choice:
///         * Acceptors: oxygens of backbone, carboxylates, amides and phosphates, up to 3.5 Å from the nitrogen and
///           within 60° of the N-H bond
///         * Donors: nitrogens with hydrogens, within the same limits
///         * Metals: up to 2.8 Å from the nitrogen
///         * Ignored: hydroxyls and water, because they may be donor or acceptor
///
///         The weight of an acceptor or donor falls from 1 at 2.5 Å to 0 at 3.5 Å. A metal outweighs all other
///         neighbours
/// In      others  residues of the file outside of chains, such as ions, whose atoms are neighbours as well
std::vector<HistidineChoice> choose_histidines(const std::vector<PdbResidue>& residues,
                                               const std::vector<PdbResidue>& others);

}  // namespace tandem::server
