// Removal of coincident faces that are triangulated differently. Private to the repair of meshes.
#pragma once

#include <cstddef>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Removes duplicate patches: sets of triangles that cover the same piece of surface, with any orientation and
/// triangulation. The first one stays. For a quad and its reverse, cut along different diagonals, two of four triangles
/// remain.
///
/// Model   A patch is a set of triangles connected by edges that have exactly two triangles and do not fold back. Two
///         patches are twins in two cases. First, their borders are the same edges and they lie close to each other
///         (twisted polygons of up to 64 corners). Second, they have the same area and each covers the other, flat
///         piece by flat piece
/// In      mesh         welded, without triangles of the same three corners
///         tolerance_m  tolerance of the welding
/// Out     number of triangles removed
/// Cost    n log n
std::size_t drop_twin_patches(TriangleMesh& mesh, double tolerance_m);

}  // namespace tandem::geometry
