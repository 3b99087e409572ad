// The interface of two molecules: its size, and poses in which it has a given size.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/spatial.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::lab {

/// Returns a JSON object with the size of the interface:
/// * "interface_atoms": number of atoms of both molecules within `reach_angstrom` of the other molecule;
/// * "pairs_within": number of pairs of atoms within this reach;
/// * "min_distance_angstrom": shortest distance of a pair; null if there is no pair within reach.
///
/// Cost    proportional to the number of atoms near the interface
boost::json::object interface_facts(const docking::Molecule& a, const docking::Molecule& b, const Pose& X_AB,
                                    double reach_angstrom);

/// Returns one pose of B for each of `sizes`. In this pose, the interface has approximately the given number of atoms.
/// B is not rotated: it approaches from far away along a line through both centres until the number is reached. Of 26
/// such lines, the one with the least overlap is used: at the last size, its smallest distance of two atoms is the
/// largest.
///
/// In      sizes  numbers of interface atoms, ascending; the atoms of both molecules are counted together
/// Fails   std::invalid_argument: no line reaches a size; the message contains this size and the largest size found
std::vector<Pose> poses_by_interface(const docking::Molecule& a, const docking::Molecule& b, double reach_angstrom,
                                     const std::vector<std::size_t>& sizes);

}  // namespace tandem::lab
