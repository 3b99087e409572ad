// What a cut-off leaves out of a field, as a potential on a grid: for large molecules that attract each other from afar.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "common/docking/field_kernel.hpp"
#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::docking {

/// Beyond this distance from the box about A's atoms, or B's diameter and 16 Å where that is more, nothing is left of the far
/// part; it fades over the last 8 Å.
inline constexpr double kFarReachAngstrom = 40;

/// Of an atom: 192 of 4 floats.
inline constexpr std::size_t kGridMultiplyAdds = 768;

class FarGrid;

/// 1 to 3 Å, the finest with at most 4e6 nodes and 2.5e9 nodes times atoms; 3 Å up to 6e9 of these; nothing: that is not
/// enough.
std::optional<double> far_grid_spacing_angstrom(const Molecule& a);

/// Model   V_far = V − V_cut: r^−α beyond the cut-off, and below it what the force switch adds, a constant below the start
///         of the switch; smooth everywhere. Σ_i c_i V_far(|x − x_i|) at the nodes of a cubic grid is the same for any
///         atom of B but for a factor: three fields, of q, of √C6 and of √C12 (geometric, also where the force field
///         mixes arithmetically). Between nodes: cubic B-splines of the node values, filtered (−1/6, 8/6, −1/6) on each
///         axis, so fourth order and twice differentiable; the force is the derivative of that energy
/// In      b      of which atoms are looked up: gives the reach
///         model  with a cut-off
/// Out     nothing where far_grid_spacing_angstrom() is
/// Cost    nodes near A times atoms: README.md; 16 B a node. The same grid again as long as somebody in the process has it: a room
///         that is reset, or another one of the same scene, need not wait for it
/// Thread  any
std::shared_ptr<const FarGrid> make_far_grid(const Molecule& a, const Molecule& b, const FieldModel& model,
                                             const KernelModel& constants, FarPointsKernel far_points);

double spacing_angstrom(const FarGrid& grid);
std::size_t node_count(const FarGrid& grid);

/// For the kernels' look-ups; as long as the grid.
const GridNodes& nodes_of(const FarGrid& grid);

}  // namespace tandem::docking
