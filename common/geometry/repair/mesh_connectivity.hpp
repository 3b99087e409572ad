// Second half of mesh repair: determines neighbours, orientation and borders of the triangles.
#pragma once

#include <string>
#include <vector>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {

/// A set of triangles that are connected by edges.
struct MeshPart {
  std::vector<int> triangles;
  /// Closed loops of vertices, each in the direction in which the part's triangles traverse it.
  std::vector<std::vector<int>> borders;
  bool is_orientable = true;
  bool is_unpaired = false;  ///< true: the part ends at an edge with three or more triangles that cannot be paired
};

inline bool is_closed(const MeshPart& part) {
  return part.borders.empty() && !part.is_unpaired && part.is_orientable;
}

/// Makes `mesh` a manifold. At an edge with more than two triangles, pairs of triangles that enclose material between
/// them are connected. If the triangles of an edge cannot be paired in this way, none of them is connected at this
/// edge. Parts that touch only at an edge or a vertex get separate vertices. All triangles of a part get the
/// orientation of the majority.
///
/// In      mesh  welded mesh
std::vector<MeshPart> connect(TriangleMesh& mesh, std::vector<std::string>& notes);

/// Returns the triangles of all parts, one part after another.
std::vector<int> triangles_of(const std::vector<MeshPart>& parts);

}  // namespace tandem::geometry
