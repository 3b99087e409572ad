// Triangles in a hole. Private to the repair of meshes.
#pragma once

#include <vector>

#include "common/geometry/repair/mesh_connectivity.hpp"

namespace tandem::geometry {

/// Closes a hole of a part; what is added belongs to it.
///
/// In      loop  of vertices around it, as MeshPart::borders has them
void close_hole(TriangleMesh& mesh, MeshPart& part, const std::vector<int>& loop);

}  // namespace tandem::geometry
