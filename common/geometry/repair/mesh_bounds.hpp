// How large a mesh is, for all that divide by it: a mesh from a file may be a point, or larger than numbers go.
#pragma once

#include <Eigen/Geometry>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// The largest coordinate of a mesh that is not scaled yet, and the inverse of the smallest size: so that neither a size
/// nor its inverse overflows, and no product of three of them does.
inline constexpr double kMaxMeshUnits = 1e100;

/// The box around the vertices that triangles use: a stray vertex does not change the size.
///
/// Out     the longest edge of the box is from 1 / kMaxMeshUnits to 2 kMaxMeshUnits: it may be divided by
/// Fails   MeshError, with the value and the remedy: no triangle; a vertex that is not finite, or too far away; all
///         vertices at one place
Eigen::AlignedBox3d mesh_bounds(const TriangleMesh& mesh);

}  // namespace tandem::geometry
