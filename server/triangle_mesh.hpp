// Triangles as the loader hands them on.
#pragma once

#include <array>
#include <vector>

#include "common/spatial.hpp"

namespace tandem {

/// Triangles in metres, in the frame of their shape.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// The convex hull of `points`, with outward triangles; empty when the points lie in one plane.
TriangleMesh convex_hull(const std::vector<Vec3>& points);

}  // namespace tandem
