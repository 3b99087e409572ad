// Quality measures of CAPRI (Critical Assessment of Predicted Interactions). They compare a pose of two rigid molecules
// with their native pose.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Two residues are in contact if two of their heavy atoms are at most this far apart [Å].
inline constexpr double kResidueContact_angstrom = 5;
/// A residue belongs to the interface if one of its heavy atoms is at most this far from a heavy atom of the other
/// molecule [Å].
inline constexpr double kInterfaceReach_angstrom = 10;

/// Returns the pairs (residue of A, residue of B) that are in contact, in ascending order. Two residues are in contact
/// if two of their heavy atoms (all atoms except hydrogens) are within `distance_angstrom` of each other. Residues are
/// counted from 0, in the order of docking::residue_starts().
///
/// In      X_AB  pose of B in A [Å]
/// Fails   see docking::residue_starts()
/// Cost    O(n m): n heavy atoms of A near B, m heavy atoms of B
std::vector<std::pair<std::size_t, std::size_t>> residue_pairs_within(const docking::Molecule& a,
                                                                      const docking::Molecule& b, const Pose& X_AB,
                                                                      double distance_angstrom);

/// Returns the ligand RMSD between two poses of the ligand in the receptor's frame: the root mean square distance of
/// its heavy atoms [Å]. CAPRI uses only the backbone. Here all heavy atoms are used, because some ligands have no
/// backbone.
double ligand_rmsd_angstrom(const docking::Molecule& ligand, const Pose& X_AB, const Pose& Y_AB);

/// Returns f_nat: the fraction of the native residue contacts (kResidueContact_angstrom) that the pose `X_AB` also has,
/// from 0 to 1. The result is NaN if the native pose has no contacts.
///
/// Source  Méndez, Leplae, De Maria, Wodak, Proteins 52 (2003) 51; Lensink, Méndez, Wodak, Proteins 69 (2007) 704
/// Fails   see docking::residue_starts()
double native_contact_share(const docking::Molecule& a, const docking::Molecule& b, const Pose& native_X_AB,
                            const Pose& X_AB);

/// Returns the interface RMSD [Å]: how much the interface in the pose `X_AB` differs from the native one. The interface
/// atoms of both molecules together are superposed on their native positions. The result is the root mean square of the
/// remaining distances. It is NaN if there are no interface atoms.
///
/// Model   A residue is part of the interface if, in the native pose, a heavy atom of it is within
///         kInterfaceReach_angstrom of a heavy atom of the other molecule. Its interface atoms are:
///         * amino acid: N, CA, C and O;
///         * nucleotide: P, O5', C5', C4', C3' and O3';
///         * residue without such a backbone (an ion, a cofactor, a drug): all heavy atoms
/// Source  see native_contact_share(); the choice of atoms for residues that are not amino acids is our own
/// Fails   see docking::residue_starts()
double interface_rmsd_angstrom(const docking::Molecule& a, const docking::Molecule& b, const Pose& native_X_AB,
                               const Pose& X_AB);

}  // namespace tandem::lab
