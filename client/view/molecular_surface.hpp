// Computes the surface of a molecule as triangles. No window is needed. It can take a second, so it must not run in the
// frame loop.
#pragma once

#include <cstddef>
#include <span>
#include <stop_token>

#include "client/view/drawn_molecule.hpp"

namespace tandem::client {

inline constexpr std::size_t kMaxSurfaceTriangles = 1'000'000;

/// Appends a smooth closed surface around the atoms, approximately at their van der Waals radii. Each vertex has the
/// colour of its nearest atom, where distances are relative to the atoms' radii. Between two atoms, the colours are
/// mixed.
///
/// Model    Surface: F(x) = Σ exp(B (1 − |x − c|²/r²)) = 1, summed over atoms with centre c and radius r. For an
///          isolated atom it is a sphere. B = 1.2; B is smaller for atoms narrower than a grid cell, so that
///          neighbouring atoms merge on a coarse grid.
///          Triangles (surface nets): each cell of the grid that the surface crosses has one vertex. The vertex starts
///          at the mean of the points where the surface crosses the cell's edges. Newton's method then moves it within
///          the cell onto F = 1. The four cells around a crossed edge give two triangles. Normals are −∇F.
/// Source   F: manual of SurfaceDiver, "Molecular surface representation", with B = ln 2; the larger B here follows the
///          atoms more closely. Surface nets: Lysenko, "Smooth voxel terrain (part 2)", 2012; Newton's method is an
///          addition
/// In       colors         one colour for each atom
///          max_triangles  limit; a surface with more triangles is computed again on a coarser grid
///          stop           after a stop request nothing is appended
/// Cost     The grid spacing is 0.4 Å up to 2000 atoms; above that the number of cells is constant. Blocks of 8 × 8 × 8
///          cells are processed one after the other, and only near atoms. Isolated atoms much smaller than a cell are
///          omitted
void append_surface(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                    std::span<const Rgba> colors, std::size_t max_triangles = kMaxSurfaceTriangles,
                    const std::stop_token& stop = {});

}  // namespace tandem::client
