// Bounding box of a mesh whose size can be used as a divisor. It is checked, because a mesh from a file may be a single
// point, or so large that numbers overflow.
#pragma once

#include <Eigen/Geometry>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Largest magnitude of a coordinate before scaling. Its inverse is the smallest size of a mesh. With these limits, the
/// size, its inverse, and products of three sizes do not overflow.
inline constexpr double kMaxMeshUnits = 1e100;

/// Returns the bounding box of the vertices that triangles use; unused vertices are ignored.
///
/// Out     a box whose longest edge is between 1 / kMaxMeshUnits and 2 kMaxMeshUnits, and therefore a safe divisor
/// Fails   MeshError: no triangle, a vertex that is not finite or too far away, or all vertices at the same place; the
///         message has the value and the remedy
Eigen::AlignedBox3d mesh_bounds(const TriangleMesh& mesh);

}  // namespace tandem::geometry
