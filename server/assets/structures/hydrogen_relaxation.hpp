// Rotates and bends built hydrogens away from atoms that they overlap.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// Hydrogens that one rule has added to one atom.
struct BuiltGroup {
  std::size_t residue = 0;         ///< index among the residues of chains
  std::vector<std::string> names;  ///< names of the group's hydrogens in that residue
  Vec3 carrier_angstrom = Vec3::Zero();
  /// true: the group can rotate about the bond from `axis_angstrom` to the carrier, as methyl and hydroxyl groups can.
  bool turns = false;
  Vec3 axis_angstrom = Vec3::Zero();
};

/// A structure file, as one part of a complex. The coordinates of all parts are in one frame.
struct RelaxedPart {
  std::vector<PdbResidue>* chains = nullptr;        ///< residues with built hydrogens, which may move
  const std::vector<PdbResidue>* others = nullptr;  ///< groups outside of chains, which do not move
  const std::vector<BuiltGroup>* groups = nullptr;
};

struct RelaxedHydrogens {
  std::vector<std::string> moved;    ///< text for the user: "HG of SER 64 of chain B, turned by 63°"
  std::vector<std::string> clashes;  ///< remaining overlaps of built hydrogens with other atoms, in the first part
};

/// Moves built hydrogens that clash with atoms of other residues. All other hydrogens keep the positions that the force
/// field's rules give.
/// 1. Groups that can rotate are rotated.
/// 2. Groups that still clash are bent, with constant bond lengths.
/// Except for rounding, the result does not depend on the order of parts, residues or atoms.
///
/// Model   Energies are in kJ/mol; r is the distance of two atoms.
///         1. Pairs of atoms more than three bonds apart: ε((s/r)¹² − 2(s/r)⁶). For a polar hydrogen and an acceptor, s
///            is 1.85 Å and ε is 4. For other pairs, s is the sum of the van der Waals radii and ε is 0.2.
///         2. Rotation by the angle φ: V/2 (1 − cos nφ). Usually n is 3 and V is 12. For hydroxyls and thiols, V is 6.
///            Next to a planar atom, n is 2 and V is 14.
///         3. Bending: 100 per Å² of squared displacement from the rotated position
/// Source  barriers of ethane, methanol and phenol: Lowe, Prog. Phys. Org. Chem. 6 (1968) 1
/// In      parts  structures; the returned texts describe only the first one. Another part is ignored if its heavy
///                atoms come nearer than 1 Å to those of the first part, because it must then be in another frame
/// Invariant  At most 5,000 groups move: those with the largest clashes. The search ends after about 2 s
RelaxedHydrogens relax_hydrogens(std::span<const RelaxedPart> parts);

}  // namespace tandem::server
