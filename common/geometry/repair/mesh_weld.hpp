// The first half of repair: one vertex a place, and only triangles that have an area.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Merges vertices that are no farther apart than 1e-7 of the bounding box's diagonal (what single-precision files
/// round by), and takes out unused vertices, triangles less high than 1e-9 of the diagonal, and surface that is there
/// twice (mesh_twins.hpp). A flat triangle whose middle corner lies on its longest side leaves no gap: the triangle
/// beyond is divided at the corner.
///
/// In      mesh  indices in range, vertices finite
/// Fails   MeshError: most vertices crowd in 1e-5 of the box, where looking for each takes the square of their number
void weld(TriangleMesh& mesh, std::vector<std::string>& notes);

/// How far apart vertices may be that are merged.
/// In      mesh  has a vertex
double weld_tolerance_m(const TriangleMesh& mesh);

}  // namespace tandem::geometry
