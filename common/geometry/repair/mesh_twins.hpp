// Removes coincident faces that are triangulated differently. Used only by mesh repair.
#pragma once

#include <cstddef>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Removes duplicate patches: sets of triangles that cover the same piece of surface, in any orientation and
/// triangulation. The first patch is kept. For example, a quad may occur twice with opposite orientations and different
/// diagonals; two of its four triangles are then kept.
///
/// Model   A patch is a set of connected triangles. It ends at edges where the surface folds back, and at edges that do
///         not have exactly two triangles. Two patches are duplicates in two cases:
///         1. Their borders consist of the same edges, and they are close to each other. This includes twisted polygons
///            of up to 64 corners.
///         2. They have the same area, and each of them covers the other, flat piece by flat piece
/// In      mesh         welded mesh without two triangles that have the same three corners
///         tolerance_m  tolerance of the welding
/// Out     number of triangles removed
/// Cost    O(n log n)
std::size_t drop_twin_patches(TriangleMesh& mesh, double tolerance_m);

}  // namespace tandem::geometry
