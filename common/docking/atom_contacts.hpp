// Contacts and hydrogen bonds between two molecules, by the usual criteria of structural biology.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Pairs (index of an atom of A, index of an atom of B), in ascending order.
using AtomPairs = std::vector<std::pair<std::size_t, std::size_t>>;

inline constexpr double kContactAngstrom = 4;

/// Returns the pairs of non-hydrogen atoms within kContactAngstrom.
/// In      X_AB_angstrom  see exact_field(); a pose that is not evaluable gives no pairs
/// Cost    linear in the number of atoms and in the size of the interface
AtomPairs atom_contacts(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);

/// Returns the hydrogen bonds between the molecules, as pairs (atom of A, atom of B). Either atom may be the donor.
///
/// Model   A donor is an N or O atom with a hydrogen H within 1.25 Å; an acceptor is any N or O atom. A hydrogen
///         bond has a distance of at most 2.5 Å between H and the acceptor, and an angle donor−H···acceptor of at least
///         120°. The N and O atoms of a molecule without hydrogens bond to every N and O atom of the other molecule
///         within 3.5 Å
/// Source  Baker, Hubbard, Prog. Biophys. Mol. Biol. 44 (1984) 97: distance and angle; 3.5 Å is the usual limit for
///         heavy atoms
AtomPairs hydrogen_bonds(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);

/// Classification of two atoms that are closer than non-bonded atoms usually are.
enum class Closeness {
  kClash,
  /// A possible hydrogen bond: the hydrogen of an N or O atom, at least kMinHydrogenBondAngstrom from an N or O atom of
  /// the other molecule.
  kHydrogenBond,
  /// Two non-hydrogen atoms at the distance of a covalent bond. Bound atoms belong in one molecule, so the division
  /// into two molecules is wrong.
  kBond,
};

struct CloseAtoms {
  std::size_t a = 0, b = 0;
  double distance_angstrom = 0;
  double share = 0;  ///< distance divided by the sum of the van der Waals radii
  Closeness closeness = Closeness::kClash;
};

/// Returns the pairs of atoms closer than kClashShare times the sum of their van der Waals radii (atom_radii()). They
/// are sorted by ascending `share`.
/// In      X_AB_angstrom  see exact_field(); a pose that is not evaluable gives no pairs
std::vector<CloseAtoms> close_atoms(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);
inline constexpr double kClashShare = 0.7;
inline constexpr double kMinHydrogenBondAngstrom = 1.3;

/// Returns the root mean square displacement of all atoms between the poses `X_1` and `X_2` [Å].
double rmsd_angstrom(const Molecule& molecule, const Pose& X_1_angstrom, const Pose& X_2_angstrom);

}  // namespace tandem::docking
