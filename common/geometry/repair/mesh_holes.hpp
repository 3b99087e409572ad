// Triangles in a hole, and where a surface ends in the open. Private to the repair of meshes.
#pragma once

#include <utility>
#include <vector>

#include "common/geometry/repair/mesh_connectivity.hpp"

namespace tandem::geometry {

/// Closes a hole of a part; what is added belongs to it.
///
/// In      loop  of vertices around it, as MeshPart::borders has them
void close_hole(TriangleMesh& mesh, MeshPart& part, const std::vector<int>& loop);

/// The edges of borders that nothing closes. Around one that ends on another surface, or inside of it, the winding number is nearly
/// whole; around one in the open it takes all values between two whole ones.
///
/// In      mesh  whose parts those are
///         all  what the winding number is of
/// Out     their middles, and how long they are [m]
std::vector<std::pair<Vec3, double>> open_edges(const TriangleMesh& mesh, const std::vector<MeshPart>& parts,
                                                const TriangleMesh& all);

}  // namespace tandem::geometry
