// The triangle mesh that files are loaded into, repair works on and contact assets are built from.
#pragma once

#include <array>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::geometry {

/// Triangles in metres, in the frame of their shape S; corners run counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

}  // namespace tandem::geometry
