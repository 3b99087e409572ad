// First half of mesh repair: merges vertices and removes triangles without area.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Merges vertices that are closer than 1e-7 of the bounding box's diagonal, the rounding error of single-precision
/// files. Removes unused vertices, duplicate surfaces (mesh_twins.hpp), and flat triangles, whose height is below 1e-9
/// of the diagonal. If the third corner of a flat triangle lies on its longest side, the neighbour across that side is
/// divided at this corner, so that no gap remains.
///
/// In      mesh  indices in range, vertices finite
/// Fails   MeshError: most vertices are within 1e-5 of the box's size, where the search would take quadratic time
void weld(TriangleMesh& mesh, std::vector<std::string>& notes);

/// Returns the largest distance at which vertices are merged.
/// In      mesh  mesh with at least one vertex
double weld_tolerance_m(const TriangleMesh& mesh);

}  // namespace tandem::geometry
