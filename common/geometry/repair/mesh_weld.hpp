// First half of mesh repair: merges vertices and removes triangles without area.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Merges vertices that are closer than 1e-7 of the bounding box's diagonal, the rounding error of single-precision
/// files. Removes unused vertices, triangles with a height below 1e-9 of the diagonal, and duplicate surface
/// (mesh_twins.hpp). The third corner of a flat triangle may lie on its longest side. The triangle across that side is
/// then divided at this corner, so that no gap remains.
///
/// In      mesh  indices in range, vertices finite
/// Fails   MeshError: most vertices are within 1e-5 of the box's size. The search would take quadratic time there
void weld(TriangleMesh& mesh, std::vector<std::string>& notes);

/// Returns the largest distance at which vertices are merged.
/// In      mesh  mesh with at least one vertex
double weld_tolerance_m(const TriangleMesh& mesh);

}  // namespace tandem::geometry
