// Computes the positions of hydrogens on an atom by the rules of GROMACS's hydrogen database.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "server/assets/structures/force_field.hpp"

namespace tandem::server {

/// Positions of a residue's atoms [Å], indexed by their names in the force field.
using AtomPlaces = std::map<std::string, Vec3, std::less<>>;

/// Returns the positions of the hydrogens of a rule. The result is empty in three cases: an atom of the rule is missing
/// or not bonded; the atoms are collinear and define no plane; the kind of the rule does not occur in proteins and
/// nucleic acids.
///
/// Model   i is the atom that carries the hydrogens, and j, k, l are its neighbours. Hydrogens are 1.0 Å from i, as for
///         the rules of aminoacids.hdb. Kinds of rules:
///         * 1 and 5: one hydrogen, opposite to the mean of the neighbours
///         * 2 and 4: hydrogens at 109.5° to i-j, the first of them trans to k
///         * 3: two hydrogens at 120° to i-j, in the plane of i, j and k
///         * 6: two hydrogens, 109.5° apart, in the plane that bisects j-i-k
///         * 4 with two hydrogens, if i has another neighbour besides j: as kind 6. Kind 4 would place a hydrogen on
///           that neighbour. Example: proline's N at the start of a chain
/// Source  GROMACS 2022 reference manual, "Hydrogen database"
/// In      before  atoms of the previous residue, for rules with "-C"; null if there is none
std::vector<Vec3> hydrogen_places(const HydrogenRule& rule, const AtomPlaces& own, const AtomPlaces* before);

/// Returns whether the hydrogens of a rule can rotate about the bond between the rule's first two atoms. Hydrogens on
/// an atom of a ring cannot.
bool turns(const HydrogenRule& rule, const AtomPlaces& own);

/// Returns a position for the missing atom C of the previous residue, by the usual angles of a chain. It is needed to
/// place the hydrogen on N of a residue that begins after a gap. Returns nothing if N, CA or C of this residue is
/// missing.
/// In      own  atoms of the residue after the gap
std::optional<Vec3> carbon_before_gap(const AtomPlaces& own);

}  // namespace tandem::server
