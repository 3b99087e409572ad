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

/// Root mean square of the way of its atoms, all of them, from `X_1` to `X_2` [Å].
double rmsd_angstrom(const Molecule& molecule, const Pose& X_1_angstrom, const Pose& X_2_angstrom);

}  // namespace tandem::docking
