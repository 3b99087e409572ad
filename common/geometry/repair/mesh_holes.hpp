// Closes holes with triangles. Used only by mesh repair.
#pragma once

#include <vector>

#include "common/geometry/repair/mesh_connectivity.hpp"

namespace tandem::geometry {

/// Closes a hole of a part, and adds the new triangles to the part.
///
/// In      loop  vertices of the hole's border, as in MeshPart::borders
void close_hole(TriangleMesh& mesh, MeshPart& part, const std::vector<int>& loop);

}  // namespace tandem::geometry
