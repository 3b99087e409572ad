// Distance between a pose of two rigid molecules and their native pose, by the measures of CAPRI.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Distance of heavy atoms below which residues of two molecules are in contact [Å].
inline constexpr double kResidueContact_angstrom = 5;
/// Distance from the other molecule's heavy atoms below which a residue is part of the interface [Å].
inline constexpr double kInterfaceReach_angstrom = 10;

/// Returns the pairs of one residue of A and one of B with heavy atoms (all but hydrogens) within `distance`,
/// ascending. Residues are counted from 0, in the order of docking::residue_starts().
///
/// In      X_AB  pose of B in A [Å]
/// Fails   like docking::residue_starts()
/// Cost    O(n m): n heavy atoms of A near B, m heavy atoms of B
std::vector<std::pair<std::size_t, std::size_t>> residue_pairs_within(const docking::Molecule& a,
                                                                      const docking::Molecule& b, const Pose& X_AB,
                                                                      double distance_angstrom);

/// Ligand RMSD: root mean square distance of the ligand's heavy atoms between two poses in the receptor's frame [Å].
/// CAPRI uses only the backbone; all heavy atoms are also defined for ligands without one.
double ligand_rmsd_angstrom(const docking::Molecule& ligand, const Pose& X_AB, const Pose& Y_AB);

/// f_nat: share of the native residue contacts (kResidueContact_angstrom) that the pose `X_AB` also has, 0 to 1. NaN
/// without native contacts.
///
/// Source  Méndez, Leplae, De Maria, Wodak, Proteins 52 (2003) 51; Lensink, Méndez, Wodak, Proteins 69 (2007) 704
/// Fails   like docking::residue_starts()
double native_contact_share(const docking::Molecule& a, const docking::Molecule& b, const Pose& native_X_AB,
                            const Pose& X_AB);

/// Interface RMSD [Å]: the interface atoms of both molecules in the pose `X_AB`, superposed on the same atoms in the
/// native pose. Returns the root mean square of the remaining distances. NaN without interface atoms.
///
/// Model   Interface residues have a heavy atom within kInterfaceReach_angstrom of a heavy atom of the other molecule
///         in the native pose. The atoms of an amino acid are N, CA, C and O; those of a nucleotide P, O5', C5', C4',
///         C3' and O3'. A residue without such a backbone (an ion, a cofactor, a drug) counts with all heavy atoms
/// Source  see native_contact_share(); the atoms of residues without an amino acid's backbone are our choice
/// Fails   like docking::residue_starts()
double interface_rmsd_angstrom(const docking::Molecule& a, const docking::Molecule& b, const Pose& native_X_AB,
                               const Pose& X_AB);

}  // namespace tandem::lab
