// Where the hydrogens of an atom are, from the rules of GROMACS's hydrogen database.
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

/// Where a rule puts its hydrogens; empty: an atom of the rule is missing, not bonded, or they are on a line, which names no plane;
/// or the rule is none that proteins and nucleic acids have.
///
/// Model   1.0 Å from their atom i, as aminoacids.hdb's rules say. With neighbours j, k, l of i: kind 1 and 5 away from
///         their mean; 6 two in the plane across j-i-k, 109.5° apart; 2 and 4 at 109.5° to i-j, first trans to k;
///         3 two at 120° to i-j, in its plane with k. Two of kind 4 on an atom that has another
///         neighbour, as proline's N at a chain's beginning, are placed by kind 6: kind 4 puts one of them on that neighbour
/// Source  GROMACS 2022 reference manual, "Hydrogen database"
/// In      before  of the residue before, for atoms "-C"; null: there is none
std::vector<Vec3> hydrogen_places(const HydrogenRule& rule, const AtomPlaces& own, const AtomPlaces* before);

/// Whether the hydrogens of a rule turn about the bond between its first two atoms: not on an atom of a ring.
bool turns(const HydrogenRule& rule, const AtomPlaces& own);

/// Where the carbon before a residue is that begins after a gap, at the angles of a chain: with it alone the hydrogen on N has a place.
/// Nothing: N, CA or C is missing.
std::optional<Vec3> carbon_before_gap(const AtomPlaces& own);

}  // namespace tandem::server
