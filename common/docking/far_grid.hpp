// The part of a field beyond a cut-off, as a potential on a grid. It is used for large molecules with long-range
// attraction.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "common/docking/field_kernel.hpp"
#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Range of the far part, measured from the box around A's atoms. For large molecules B the range is B's diameter plus
/// 16 Å. The far part fades to zero over the last 8 Å.
inline constexpr double kFarReachAngstrom = 40;

/// Number of multiply-adds per atom in a look-up: 192 operations on 4 floats.
inline constexpr std::size_t kGridMultiplyAdds = 768;

class FarGrid;

/// Returns the grid spacing, 1 to 3 Å. It is the finest spacing with at most 4e6 nodes and a product of nodes and atoms
/// of at most 2.5e9. At 3 Å the product may be up to 6e9. If it is larger, the result is empty.
std::optional<double> far_grid_spacing_angstrom(const Molecule& a);

/// Creates the grid, or returns an existing one for the same inputs.
///
/// Model   V_far = V − V_cut, where V is the pair energy without and V_cut the one with the cut-off. Beyond the cut-off
///         V_far is r^−α. Within it V_far is the term that the force switch adds, which is constant below the start of
///         the switch. V_far is smooth everywhere. At each node the grid has the sum Σ_i c_i V_far(|x − x_i|) over A's
///         atoms i with coefficients c_i. Except for a factor this sum is the same for each atom of B, so three sums
///         suffice: with c = q, √C6 and √C12. They use geometric mixing, even if the force field mixes arithmetically.
///         The sums are interpolated by cubic B-splines, whose coefficients are the node values filtered by (−1/6, 8/6,
///         −1/6) along each axis. The interpolation is fourth-order accurate and twice differentiable. The force is the
///         derivative of the interpolated energy
/// In      b      molecule whose atoms are looked up; it determines the range
///         model  must have a cut-off
/// Out     null if far_grid_spacing_angstrom() is empty
/// Cost    the number of nodes near A times the number of atoms: FIELDS.md; 16 B per node. A grid is shared in the
///         process as long as anyone uses it. A room that is reset, or another room with the same scene, need not wait
///         for a new one
/// Thread  any
std::shared_ptr<const FarGrid> make_far_grid(const Molecule& a, const Molecule& b, const FieldModel& model,
                                             const KernelModel& constants, FarPointsKernel far_points);

double spacing_angstrom(const FarGrid& grid);
std::size_t node_count(const FarGrid& grid);

/// Nodes for the look-ups of the kernels; valid as long as the grid exists.
const GridNodes& nodes_of(const FarGrid& grid);

}  // namespace tandem::docking
