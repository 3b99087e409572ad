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
  bool turns = false;  ///< can rotate about the bond from `axis_angstrom` to the carrier, as a methyl group or a
                       ///< hydroxyl
  Vec3 axis_angstrom = Vec3::Zero();
};

/// One of several structures whose coordinates are in the same frame.
struct RelaxedPart {
  std::vector<PdbResidue>* chains = nullptr;        ///< residues whose built hydrogens move
  const std::vector<PdbResidue>* others = nullptr;  ///< groups that belong to no chain and do not move
  const std::vector<BuiltGroup>* groups = nullptr;
};

struct RelaxedHydrogens {
  std::vector<std::string> moved;    ///< for the user: "HG of SER 64 of chain B, turned by 63°"
  std::vector<std::string> clashes;  ///< remaining clashes of built hydrogens of the first part with its other atoms
};

/// Moves built hydrogens that clash with atoms of other residues. All other hydrogens keep the positions of the force
/// field's rules. Groups that can rotate are rotated first. Groups that still clash are then bent, with constant bond
/// lengths. Except for rounding, the result does not depend on the order of parts, residues or atoms.
///
/// Model   Energies are in kJ/mol. Pairs more than three bonds apart: ε((s/r)¹² − 2(s/r)⁶), where s is the sum of the
///         van der Waals radii and ε is 0.2. A polar hydrogen and an acceptor: s is 1.85 Å and ε is 4. Rotation:
///         V/2 (1 − cos nφ) with n = 3 and V = 12; V = 6 for hydroxyls and thiols; n = 2 and V = 14 next to a planar
///         atom. Bending: 100 for each Å² of squared displacement from the rotated position
/// Source  barriers of ethane, methanol and phenol: Lowe, Prog. Phys. Org. Chem. 6 (1968) 1
/// In      parts  a part whose heavy atoms come nearer than 1 Å to those of the first part is ignored, because it must
///         be in another frame
/// Invariant  at most 5,000 groups move, those with the largest clashes; the search ends after about 2 s
RelaxedHydrogens relax_hydrogens(std::span<const RelaxedPart> parts);

}  // namespace tandem::server
