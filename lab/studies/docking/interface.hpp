// The interface of two molecules: its size, and poses with a wanted interface size.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// {"interface_atoms", "pairs_within", "min_distance_angstrom" (null without pairs)}: number of atoms within reach of
/// the other molecule, number of atom pairs within reach, and the shortest distance, counted pair by pair.
/// Cost   the neighbourhood of the interface
boost::json::object interface_facts(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB,
                                    double reach_angstrom);

/// Poses of B, without rotation, each with about the wanted number of interface atoms. B approaches from far away
/// along a line through both centres until it has that many. Of 26 such lines the one with the least overlap at the
/// last size is used, which is the one with the largest shortest distance.
///
/// In      sizes  ascending numbers of atoms, both molecules counted together
/// Fails   std::invalid_argument naming the size and the largest size found, where no line reaches it
std::vector<Pose> poses_by_interface(const docking::Molecule& a, const docking::Molecule& b, double reach_angstrom,
                                     const std::vector<std::size_t>& sizes);

}  // namespace tandem::lab
