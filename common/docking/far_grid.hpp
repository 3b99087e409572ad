// The part of a field beyond a cut-off, as a potential on a grid: for large molecules with long-range attraction.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "common/docking/field_kernel.hpp"
#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Range of the far part, from the box around A's atoms; for larger molecules B's diameter plus 16 Å. It fades over the
/// last 8 Å.
inline constexpr double kFarReachAngstrom = 40;

/// Multiply-adds of a look-up per atom: 192 of 4 floats.
inline constexpr std::size_t kGridMultiplyAdds = 768;

class FarGrid;

/// Grid spacing, 1 to 3 Å: the finest with at most 4e6 nodes and a product of nodes and atoms of at most 2.5e9. At 3 Å
/// the product may reach 6e9; empty if that is exceeded.
std::optional<double> far_grid_spacing_angstrom(const Molecule& a);

/// Makes the grid.
///
/// Model   V_far = V − V_cut: r^−α beyond the cut-off. Below it, the part that the force switch adds, constant below
///         the start of the switch; smooth everywhere. Σ_i c_i V_far(|x − x_i|) at the nodes of a cubic grid is the
///         same for each atom of B except for a factor. Hence three fields: of q, of √C6 and of √C12 (geometric, also
///         where the force field mixes arithmetically). Between nodes: cubic B-splines of the node values, filtered
///         (−1/6, 8/6, −1/6) on each axis, thus fourth order and twice differentiable; the force is the derivative of
///         that energy
/// In      b      molecule whose atoms are looked up; determines the range
///         model  with a cut-off
/// Out     null if far_grid_spacing_angstrom() is empty
/// Cost    nodes near A times atoms: FIELDS.md; 16 B a node. The process shares a grid while it exists: a room that is
///         reset, or another one of the same scene, need not wait for it
/// Thread  any
std::shared_ptr<const FarGrid> make_far_grid(const Molecule& a, const Molecule& b, const FieldModel& model,
                                             const KernelModel& constants, FarPointsKernel far_points);

double spacing_angstrom(const FarGrid& grid);
std::size_t node_count(const FarGrid& grid);

/// Nodes for the kernels' look-ups; valid as long as the grid.
const GridNodes& nodes_of(const FarGrid& grid);

}  // namespace tandem::docking
