// Built hydrogens turned and bent away from atoms that they would overlap with.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// The hydrogens that one rule put on one atom.
struct BuiltGroup {
  std::size_t residue = 0;         ///< index among the residues of chains
  std::vector<std::string> names;  ///< of its hydrogens in that residue
  Vec3 carrier_angstrom = Vec3::Zero();
  bool turns = false;  ///< about the bond from `axis_angstrom` to the carrier: methyl, ammonium, hydroxyl, thiol
  Vec3 axis_angstrom = Vec3::Zero();
};

/// One structure of those that lie in one frame.
struct RelaxedPart {
  std::vector<PdbResidue>* chains = nullptr;        ///< the residues whose built hydrogens move
  const std::vector<PdbResidue>* others = nullptr;  ///< groups of no chain, which stay
  const std::vector<BuiltGroup>* groups = nullptr;
};

struct RelaxedHydrogens {
  std::vector<std::string> moved;    ///< for people: "HG of SER 64 of chain B, turned by 63°"
  std::vector<std::string> clashes;  ///< those left: built hydrogens of the first part with its other atoms
};

/// Moves built hydrogens that clash with atoms of other residues, and no others: the rest stay where the force field's rules put them. Groups that turn do so first,
/// then what still clashes bends; bonds keep their length. The result does not depend on the order of parts, residues or atoms but by
/// rounding.
///
/// Model   energies in kJ/mol: of pairs more than three bonds apart ε((s/r)¹² − 2(s/r)⁶), s the sum of van der Waals radii, ε 0.2;
///         between a polar hydrogen and an acceptor s 1.85 Å, ε 4; of turning V/2 (1 − cos nφ), n 3 and V 12, of hydroxyls and thiols V 6,
///         at an atom of a plane n 2 and V 14; of bending 100 for each Å² from the turned place
/// Source  barriers of ethane, methanol and phenol: Lowe, Prog. Phys. Org. Chem. 6 (1968) 1
/// In      parts  a part whose heavy atoms come nearer than 1 Å to those of the first lies in another frame, and is left out
/// Bounded: of groups that clash at most 5,000 move, those that clash most, and all together for some 2 s
RelaxedHydrogens relax_hydrogens(std::span<const RelaxedPart> parts);

}  // namespace tandem::server
