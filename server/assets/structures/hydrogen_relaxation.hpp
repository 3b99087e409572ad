// Rotates and bends built hydrogens away from atoms with which they overlap.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// Hydrogens that one rule added to one atom.
struct BuiltGroup {
  std::size_t residue = 0;         ///< index among the residues of chains
  std::vector<std::string> names;  ///< names of its hydrogens in that residue
  Vec3 carrier_angstrom = Vec3::Zero();
  bool turns = false;  ///< about the bond from `axis_angstrom` to the carrier: methyl, ammonium, hydroxyl, thiol
  Vec3 axis_angstrom = Vec3::Zero();
};

/// One of several structures in one frame.
struct RelaxedPart {
  std::vector<PdbResidue>* chains = nullptr;        ///< residues whose built hydrogens move
  const std::vector<PdbResidue>* others = nullptr;  ///< groups of no chain, which do not move
  const std::vector<BuiltGroup>* groups = nullptr;
};

struct RelaxedHydrogens {
  std::vector<std::string> moved;    ///< for the user: "HG of SER 64 of chain B, turned by 63°"
  std::vector<std::string> clashes;  ///< remaining clashes of built hydrogens of the first part with its other atoms
};

/// Moves built hydrogens that clash with atoms of other residues. All others keep the positions of the force field's
/// rules. Groups that can rotate do so first; groups that still clash are then bent, with constant bond lengths. Except
/// for rounding, the result does not depend on the order of parts, residues or atoms.
///
/// Model   energies in kJ/mol. Pairs more than three bonds apart: ε((s/r)¹² − 2(s/r)⁶), s the sum of van der Waals
///         radii, ε 0.2; a polar hydrogen and an acceptor: s 1.85 Å, ε 4. Rotation: V/2 (1 − cos nφ), n 3 and V 12,
///         hydroxyls and thiols V 6, next to a planar atom n 2 and V 14. Bending: 100 for each Å² from the rotated
///         position
/// Source  barriers of ethane, methanol and phenol: Lowe, Prog. Phys. Org. Chem. 6 (1968) 1
/// In      parts  a part is in another frame, and is ignored, if its heavy atoms come nearer than 1 Å to those of the
///         first
/// Invariant  at most 5,000 groups move, those with the largest clashes, and the search ends after about 2 s
RelaxedHydrogens relax_hydrogens(std::span<const RelaxedPart> parts);

}  // namespace tandem::server
