// The second half of repair: which triangle goes on in which, which way each part faces, and where it ends.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {

/// Triangles that hang together by their edges.
struct MeshPart {
  std::vector<int> triangles;
  std::vector<std::vector<int>> borders;  ///< loops of vertices, in the direction of the triangles at them
  bool is_orientable = true;
  bool is_unpaired = false;  ///< it ends at an edge of three or more triangles that do not pair up
};

inline bool is_closed(const MeshPart& part) {
  return part.borders.empty() && !part.is_unpaired && part.is_orientable;
}

/// Makes `mesh` a manifold: where more than two triangles meet at an edge, those that enclose material between them are
/// taken together, and parts that touch only at an edge or a vertex get vertices of their own. Turns the triangles of
/// each part alike, as most of them run.
///
/// In      mesh  welded
/// Where they do not pair up, each triangle at the edge ends there.
std::vector<MeshPart> connect(TriangleMesh& mesh, std::vector<std::string>& notes);

/// Of all these parts, one after the other.
std::vector<int> triangles_of(const std::vector<MeshPart>& parts);

}  // namespace tandem::geometry
