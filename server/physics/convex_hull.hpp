// What a moving mesh collides as where Bullet steps it.
#pragma once

#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::server {

/// The convex hull of `points`, with outward triangles; empty when the points lie in one plane.
geometry::TriangleMesh convex_hull(const std::vector<Vec3>& points);

}  // namespace tandem::server
