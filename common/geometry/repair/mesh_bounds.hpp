// Bounding box of a mesh, checked for use as a divisor: a mesh from a file may be a single point or overflow.
#pragma once

#include <Eigen/Geometry>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Limit of the coordinates of an unscaled mesh, and inverse limit of its size. With it, neither a size, nor its
/// inverse, nor a product of three of them overflows.
inline constexpr double kMaxMeshUnits = 1e100;

/// Returns the box around the vertices that triangles use; unused vertices do not count.
///
/// Out     the longest edge of the box is between 1 / kMaxMeshUnits and 2 kMaxMeshUnits, and so is a safe divisor
/// Fails   MeshError, with the value and the remedy: no triangle; a vertex that is not finite or too far away; all
///         vertices at one place
Eigen::AlignedBox3d mesh_bounds(const TriangleMesh& mesh);

}  // namespace tandem::geometry
