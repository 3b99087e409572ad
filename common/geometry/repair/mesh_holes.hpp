// Closes holes with triangles. Private to the repair of meshes.
#pragma once

#include <vector>

#include "common/geometry/repair/mesh_connectivity.hpp"

namespace tandem::geometry {

/// Closes a hole of a part and adds the new triangles to it.
///
/// In      loop  vertices around the hole, as in MeshPart::borders
void close_hole(TriangleMesh& mesh, MeshPart& part, const std::vector<int>& loop);

}  // namespace tandem::geometry
