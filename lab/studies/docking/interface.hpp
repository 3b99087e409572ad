// The interface of two molecules: its size, and poses in which it has a given size.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Returns {"interface_atoms", "pairs_within", "min_distance_angstrom"}: the number of atoms within reach of the other
/// molecule, the number of atom pairs within reach, and the shortest distance (null if there are no pairs). All values
/// are computed by a loop over the atom pairs.
/// Cost    proportional to the number of atoms near the interface
boost::json::object interface_facts(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB,
                                    double reach_angstrom);

/// Returns poses of B, without rotation, each with approximately the given number of interface atoms. B approaches from
/// far away along a line through both centres until the number is reached. Of 26 such lines, the one with the least
/// overlap at the last size is used, i.e. with the largest minimum distance of atoms.
///
/// In      sizes  numbers of interface atoms, ascending; the atoms of both molecules are counted together
/// Fails   std::invalid_argument: no line reaches a size; the message contains this size and the largest size found
std::vector<Pose> poses_by_interface(const docking::Molecule& a, const docking::Molecule& b, double reach_angstrom,
                                     const std::vector<std::size_t>& sizes);

}  // namespace tandem::lab
