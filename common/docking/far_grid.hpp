// The part of a molecular field beyond the cut-off, as a potential on a grid around molecule A. It is used for large
// molecules with long-range attraction.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "common/docking/field_kernel.hpp"
#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Minimum reach: length by which the grid extends beyond the box around A's atoms. For a large molecule B, the reach
/// is B's diameter plus 16 Å. The potential fades to zero over the last 8 Å.
inline constexpr double kFarReachAngstrom = 40;

/// Number of multiply-adds for one atom's look-up in the grid: 192 operations on 4 floats.
inline constexpr std::size_t kGridMultiplyAdds = 768;

class FarGrid;

/// Returns the grid spacing [Å], 1 to 3. It is the finest spacing with at most 4e6 nodes and a product of nodes and
/// atoms of at most 2.5e9 (at 3 Å: 6e9). Returns nothing if even 3 Å exceeds these limits.
std::optional<double> far_grid_spacing_angstrom(const Molecule& a);

/// Creates the grid, or returns an existing one for the same inputs.
///
/// Model   V_far = V − V_cut is the part of a pair's energy that the cut-off removes: V is the energy without the
///         cut-off, and V_cut the energy with it. Beyond the cut-off V_far = V, a power r^−α of the distance r. Within
///         the cut-off V_far is the term that the force switch subtracts from the energy; it is constant below the
///         start of the switch. V_far is smooth everywhere.
///         Grid: a node at x stores Σ_i c_i V_far(|x − x_i|), summed over A's atoms i at x_i with coefficients c_i. For
///         each atom of B, this sum is only multiplied by a factor. Three sums therefore suffice: with c = q, √C6 and
///         √C12. They imply geometric mixing, even if the force field mixes arithmetically.
///         Interpolation: cubic B-splines, whose coefficients are the node values filtered by (−1/6, 8/6, −1/6) along
///         each axis. The interpolation is fourth-order accurate and twice differentiable. The force is the derivative
///         of the interpolated energy
/// In      b      molecule whose atoms are interpolated in the grid; its size determines the grid's reach
///         model  must have a cut-off
/// Out     null if far_grid_spacing_angstrom() is empty
/// Cost    time: number of nodes near A times number of atoms, see FIELDS.md. Memory: 16 B per node. All users in the
///         process that need the same grid share it. A room that is reset, or a second room with the same scene, need
///         not compute it again
/// Thread  any
std::shared_ptr<const FarGrid> make_far_grid(const Molecule& a, const Molecule& b, const FieldModel& model,
                                             const KernelModel& constants, FarPointsKernel far_points);

double spacing_angstrom(const FarGrid& grid);
std::size_t node_count(const FarGrid& grid);

/// Returns the nodes for the look-ups of the kernels; valid as long as the grid exists.
const GridNodes& nodes_of(const FarGrid& grid);

}  // namespace tandem::docking
