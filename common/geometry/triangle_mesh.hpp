// The triangle mesh: result of loading a file, input and output of repair, and input of contact assets.
#pragma once

#include <array>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::geometry {

/// Triangles in metres, in the frame of their shape S. Their corners are counter-clockwise when seen from outside.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

}  // namespace tandem::geometry
