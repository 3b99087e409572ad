// Computes the positions of an atom's hydrogens from the rules of GROMACS's hydrogen database.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "server/assets/structures/force_field.hpp"

namespace tandem::server {

/// Positions of a residue's atoms, by the force field's names [Å].
using AtomPlaces = std::map<std::string, Vec3, std::less<>>;

/// Positions of the hydrogens of a rule. Empty if an atom of the rule is missing or not bonded, or if the atoms are
/// collinear and define no plane. Also empty for a rule that proteins and nucleic acids do not have.
///
/// Model   1.0 Å from their atom i, as the rules of aminoacids.hdb say. With neighbours j, k, l of i: kinds 1 and 5
///         away from their mean; 6 two in the plane across j-i-k, 109.5° apart; 2 and 4 at 109.5° to i-j, first trans
///         to k; 3 two at 120° to i-j, in its plane with k. Two hydrogens of kind 4 on an atom with another neighbour,
///         such as proline's N at the start of a chain, are placed by kind 6: kind 4 places one of them on that
///         neighbour
/// Source  GROMACS 2022 reference manual, "Hydrogen database"
/// In      before  atoms of the previous residue, for atoms "-C"; null if there is none
std::vector<Vec3> hydrogen_places(const HydrogenRule& rule, const AtomPlaces& own, const AtomPlaces* before);

/// Returns whether the hydrogens of a rule rotate about the bond between its first two atoms. False for an atom of a
/// ring.
bool turns(const HydrogenRule& rule, const AtomPlaces& own);

/// Position of the carbon before a residue that begins after a gap, at the usual angles of a chain. The hydrogen on N
/// can only be placed with it. Nothing if N, CA or C is missing.
std::optional<Vec3> carbon_before_gap(const AtomPlaces& own);

}  // namespace tandem::server
