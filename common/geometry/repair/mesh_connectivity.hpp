// Second half of repair: neighbours, orientation and borders of the triangles.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {

/// Triangles connected by their edges.
struct MeshPart {
  std::vector<int> triangles;
  std::vector<std::vector<int>> borders;  ///< loops of vertices, in the direction of the adjacent triangles
  bool is_orientable = true;
  bool is_unpaired = false;  ///< it ends at an edge of three or more triangles that do not pair up
};

inline bool is_closed(const MeshPart& part) {
  return part.borders.empty() && !part.is_unpaired && part.is_orientable;
}

/// Makes `mesh` a manifold. At an edge of more than two triangles, those that enclose material between them are joined.
/// Where they do not pair up, each triangle ends at the edge. Parts that touch only at an edge or a vertex get vertices
/// of their own. The triangles of each part are oriented alike, as the majority is.
///
/// In      mesh  welded
std::vector<MeshPart> connect(TriangleMesh& mesh, std::vector<std::string>& notes);

/// Returns the triangles of all parts, one part after the other.
std::vector<int> triangles_of(const std::vector<MeshPart>& parts);

}  // namespace tandem::geometry
