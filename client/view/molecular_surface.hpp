// The surface of a molecule as triangles. No window is needed for it, and it may take a second: aside from the frames.
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>

#include "client/view/drawn_molecule.hpp"

namespace tandem::client {

inline constexpr std::size_t kMaxSurfaceTriangles = 1'000'000;

/// Adds a smooth closed surface about the atoms' van der Waals radii, each corner in the colour of the atom that is
/// nearest in its radii, beside a seam in a mixture.
///
/// Model    F(x) = Σ exp(B (1 − |x − c|²/r²)) = 1 over atoms at c of radius r: for an atom that is alone its ball. B = 1.2, and
///          less for atoms that would be narrower than the grid: those of a coarse one blur into each other. The surface is
///          meshed by surface nets: a vertex in each cell of the grid that it crosses, at the mean of where the cell's edges
///          do, then on F = 1 by Newton's method within the cell; four such cells around an edge are two triangles. Normals are −∇F
/// Source   F: the manual of SurfaceDiver, "Molecular surface representation", whose B is ln 2: ours follows the atoms more
///          closely. Surface nets: Lysenko, "Smooth voxel terrain (part 2)", 2012; Newton's method is ours
/// In       colors         one for each atom
///          max_triangles  a surface of more is made anew on a coarser grid
///          stop           once requested, nothing is added
/// Cost     the grid: 0.4 Å up to 2000 atoms, then as many cells whatever the number of atoms; blocks of 8 × 8 × 8 cells one by
///          one, and only where atoms are. Atoms that are alone and much smaller than a cell are left out
void append_surface(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                    std::span<const Rgba> colors, std::size_t max_triangles = kMaxSurfaceTriangles,
                    const std::stop_token& stop = {});

}  // namespace tandem::client
