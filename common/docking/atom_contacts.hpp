// How two molecules sit on each other, as structural biologists count it.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Pairs of one atom of A and one of B, by their indices, ascending.
using AtomPairs = std::vector<std::pair<std::size_t, std::size_t>>;

inline constexpr double kContactAngstrom = 4;

/// Atoms other than hydrogen within kContactAngstrom.
/// In      X_AB_angstrom  as of exact_field(); one that is not evaluable has no pairs
/// Cost    by the atoms, and by the size of the interface
AtomPairs atom_contacts(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);

/// Hydrogen bonds between the two, as donor and acceptor or acceptor and donor.
///
/// Model   N or O with a hydrogen within 1.25 Å is a donor; any N or O an acceptor. Bonded: H···A at most 2.5 Å and the
///         angle D−H···A at least 120°. Of a molecule without hydrogens: N, O within 3.5 Å of N, O of the other
/// Source  Baker, Hubbard, Prog. Biophys. Mol. Biol. 44 (1984) 97: distance and angle; 3.5 Å is the usual bound of
///         heavy atoms
AtomPairs hydrogen_bonds(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);

/// What two atoms are to each other that are too near for a contact without a bond.
enum class Closeness {
  kClash,
  kHydrogenBond,  ///< a hydrogen on N or O, 1.3 Å at least from an N or O of the other molecule
  kBond,          ///< heavy atoms at the length of a covalent bond: such a pair belongs into one molecule
};

struct CloseAtoms {
  std::size_t a = 0, b = 0;
  double distance_angstrom = 0;
  double share = 0;  ///< of the sum of van der Waals radii
  Closeness closeness = Closeness::kClash;
};

/// Pairs of atoms nearer than kClashShare of the sum of their van der Waals radii (atom_radii()), the smallest share first.
/// In      X_AB_angstrom  as of exact_field(); one that is not evaluable has no pairs
std::vector<CloseAtoms> close_atoms(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);
inline constexpr double kClashShare = 0.7;
inline constexpr double kMinHydrogenBondAngstrom = 1.3;

/// Root mean square of the way of its atoms, all of them, from `X_1` to `X_2` [Å].
double rmsd_angstrom(const Molecule& molecule, const Pose& X_1_angstrom, const Pose& X_2_angstrom);

}  // namespace tandem::docking
