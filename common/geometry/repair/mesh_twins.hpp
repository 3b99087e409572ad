// Faces that lie on each other but are cut differently. Private to the repair of meshes.
#pragma once

#include <cstddef>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Of sets of triangles that cover the same piece of surface, however they run and are cut, only the first stays: of a
/// quad and its reverse, cut along different diagonals, two of four triangles.
///
/// Model   A patch is what hangs together over edges of exactly two triangles that do not fold back. Two patches are
///         twins when their borders are the same edges and they lie close to each other (twisted polygons of up to
///         64 corners), or when they have the same area and each covers the other, flat piece by flat piece
/// In      mesh  welded, without triangles of the same three corners; tolerance_m: what it was welded by
/// Out     how many triangles were taken out
/// Cost    n log n
std::size_t drop_twin_patches(TriangleMesh& mesh, double tolerance_m);

}  // namespace tandem::geometry
