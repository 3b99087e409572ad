// Contacts between two molecules, by the criteria of structural biology.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Pairs of an atom of A and an atom of B, by index, ascending.
using AtomPairs = std::vector<std::pair<std::size_t, std::size_t>>;

inline constexpr double kContactAngstrom = 4;

/// Pairs of atoms other than hydrogen within kContactAngstrom.
/// In      X_AB_angstrom  see exact_field(); a pose that is not evaluable gives no pairs
/// Cost    linear in the atoms and the size of the interface
AtomPairs atom_contacts(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);

/// Hydrogen bonds between the molecules, as pairs of donor and acceptor or of acceptor and donor.
///
/// Model   N or O with a hydrogen within 1.25 Å is a donor; any N or O is an acceptor. A bond has H···A at most 2.5 Å
///         and an angle D−H···A of at least 120°. In a molecule without hydrogens: N or O within 3.5 Å of an N or O of
///         the other molecule
/// Source  Baker, Hubbard, Prog. Biophys. Mol. Biol. 44 (1984) 97: distance and angle; 3.5 Å is the usual bound for
///         heavy atoms
AtomPairs hydrogen_bonds(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);

/// Relation of two atoms that are closer than a contact without a bond allows.
enum class Closeness {
  kClash,
  kHydrogenBond,  ///< a hydrogen on N or O, at least 1.3 Å from an N or O of the other molecule
  kBond,          ///< heavy atoms at the length of a covalent bond: such a pair belongs into one molecule
};

struct CloseAtoms {
  std::size_t a = 0, b = 0;
  double distance_angstrom = 0;
  double share = 0;  ///< distance over the sum of van der Waals radii
  Closeness closeness = Closeness::kClash;
};

/// Pairs of atoms closer than kClashShare of the sum of their van der Waals radii (atom_radii()), smallest share first.
/// In      X_AB_angstrom  see exact_field(); a pose that is not evaluable gives no pairs
std::vector<CloseAtoms> close_atoms(const Molecule& a, const Molecule& b, const Pose& X_AB_angstrom);
inline constexpr double kClashShare = 0.7;
inline constexpr double kMinHydrogenBondAngstrom = 1.3;

/// Root mean square displacement of all atoms from `X_1` to `X_2` [Å].
double rmsd_angstrom(const Molecule& molecule, const Pose& X_1_angstrom, const Pose& X_2_angstrom);

}  // namespace tandem::docking
