// Collision shape of a moving mesh where Bullet steps it.
#pragma once

#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// Returns the convex hull of `points`, with outward triangles; empty if the points are coplanar.
geometry::TriangleMesh convex_hull(const std::vector<Vec3>& points);

}  // namespace tandem::server
