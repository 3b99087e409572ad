// First half of repair: merges vertices and removes triangles without area.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Merges vertices within 1e-7 of the bounding box's diagonal, the rounding of single-precision files. Removes unused
/// vertices, triangles with a height below 1e-9 of the diagonal, and duplicate surface (mesh_twins.hpp). Removing a
/// flat triangle whose middle corner lies on its longest side leaves no gap: the triangle beyond that side is divided
/// at the corner.
///
/// In      mesh  indices in range, vertices finite
/// Fails   MeshError: most vertices crowd within 1e-5 of the box, where the search is quadratic in their number
void weld(TriangleMesh& mesh, std::vector<std::string>& notes);

/// Largest distance at which vertices are merged.
/// In      mesh  has at least one vertex
double weld_tolerance_m(const TriangleMesh& mesh);

}  // namespace tandem::geometry
