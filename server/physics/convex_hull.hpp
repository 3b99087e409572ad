// Convex hull of points. It serves as the collision shape in Bullet of a moving mesh.
#pragma once

#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// Returns the convex hull of `points`, with outward-facing triangles. It is empty if the points are coplanar.
geometry::TriangleMesh convex_hull(const std::vector<Vec3>& points);

}  // namespace tandem::server
