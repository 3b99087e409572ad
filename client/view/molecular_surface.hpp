// The surface of a molecule as triangles. Needs no window. It may take a second, so it runs outside the frame loop.
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>

#include "client/view/drawn_molecule.hpp"

namespace tandem::client {

inline constexpr std::size_t kMaxSurfaceTriangles = 1'000'000;

/// Appends a smooth closed surface about the atoms' van der Waals radii. Each corner has the colour of the atom nearest
/// relative to its radius, and a mixture near the seam between two atoms.
///
/// Model    F(x) = Σ exp(B (1 − |x − c|²/r²)) = 1 over atoms at c of radius r: a ball for an isolated atom. B = 1.2,
///          and less for atoms narrower than the grid, so that on a coarse grid neighbouring atoms blur. Surface nets:
///          each cell that the surface crosses has a vertex, which starts at the mean of the crossings of the cell's
///          edges. Newton's method within the cell moves it onto F = 1. The four cells around an edge give two
///          triangles. Normals are −∇F
/// Source   F: the manual of SurfaceDiver, "Molecular surface representation", where B is ln 2; this B follows the
///          atoms more closely. Surface nets: Lysenko, "Smooth voxel terrain (part 2)", 2012; Newton's method is added
///          here
/// In       colors         one for each atom
///          max_triangles  a surface with more is made again on a coarser grid
///          stop           once requested, nothing is appended
/// Cost     the grid: 0.4 Å up to 2000 atoms, then a constant number of cells; blocks of 8 × 8 × 8 cells in turn, and
///          only near atoms. Isolated atoms much smaller than a cell are omitted
void append_surface(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                    std::span<const Rgba> colors, std::size_t max_triangles = kMaxSurfaceTriangles,
                    const std::stop_token& stop = {});

}  // namespace tandem::client
