// Where two molecules touch: how much of them, and poses in which it is as much as wanted.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// {"interface_atoms", "pairs_within", "min_distance_angstrom" (null without pairs)}: atoms of both molecules nearer to the
/// other than the reach, the pairs of them, and the shortest, counted pair by pair.
/// Cost   the neighbourhood of the interface
boost::json::object interface_facts(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB,
                                    double reach_angstrom);

/// Poses of B, not turned, each with about as many interface atoms as wanted: B comes from far away along one line through
/// both centres until there are as many. Of 26 such lines the one that brings the last size with the least overlap, which is the
/// largest shortest distance.
///
/// In      sizes  ascending, atoms of both molecules
/// Fails   std::invalid_argument naming the size and the most there are, where no line brings so many
std::vector<Pose> poses_by_interface(const docking::Molecule& a, const docking::Molecule& b, double reach_angstrom,
                                     const std::vector<std::size_t>& sizes);

}  // namespace tandem::lab
