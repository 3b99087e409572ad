// Adjacency of triangles at edges, used for repair and for feature detection.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// An edge of a mesh with the one or two triangles that use it.
struct MeshEdge {
  int a = 0;
  int b = 0;
  int left = -1;   ///< triangle that traverses the edge from a to b; −1: none
  int right = -1;  ///< second triangle; −1: none, so the edge is a border
};

/// Use of an edge by one triangle.
struct HalfEdge {
  int triangle = 0;
  int side = 0;  ///< side of the triangle, from corner `side` to the next corner
};

/// All half-edges of a mesh, grouped by edge, in an order that depends only on the mesh.
class EdgeUses {
 public:
  explicit EdgeUses(const TriangleMesh& mesh);

  std::size_t edge_count() const { return starts_.size() - 1; }
  std::span<const HalfEdge> uses(std::size_t edge) const {
    return std::span(uses_).subspan(starts_[edge], starts_[edge + 1] - starts_[edge]);
  }

 private:
  std::vector<HalfEdge> uses_;
  std::vector<std::size_t> starts_;
};

/// Returns the vertex at which a half-edge starts.
inline int start_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>(half.side)];
}
/// Returns the vertex at which a half-edge ends.
inline int end_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>((half.side + 1) % 3)];
}
/// Returns the vertex of the triangle that is opposite to a half-edge.
inline int apex_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>((half.side + 2) % 3)];
}

/// Returns the edges of a repaired mesh. In an unrepaired mesh, more than two triangles may use an edge. They are then
/// paired in their order, and the result has one edge for each pair.
std::vector<MeshEdge> mesh_edges(const TriangleMesh& mesh);

/// Returns the part number of each triangle. Triangles that share a vertex belong to the same part. Parts are numbered
/// in the order of their first triangles.
std::vector<std::size_t> parts_by_vertices(const TriangleMesh& mesh);

/// Returns the connected regions of the selected triangles, in the order of their first triangles. Two triangles are
/// connected by an edge if they traverse it in opposite directions and no third triangle uses it. All triangles of a
/// region are thus consistently oriented.
///
/// In      edges  edge numbers of each triangle, starting at its first corner; any numbering of the edges
std::vector<std::vector<int>> regions_by_edges(const TriangleMesh& mesh,
                                               std::span<const std::array<std::uint32_t, 3>> edges,
                                               const std::vector<bool>& is_one_of_them);

/// Returns a mesh of the given triangles and their vertices. For few triangles, the cost is independent of the size of
/// `mesh`.
TriangleMesh part_of(const TriangleMesh& mesh, std::span<const int> triangles);

std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t triangle);

/// Returns the cross product of two sides: a vector along the normal whose length is twice the area.
inline Vec3 doubled_area(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& corner = mesh.triangles[triangle];
  const Vec3& a = mesh.vertices[static_cast<std::size_t>(corner[0])];
  const Vec3& b = mesh.vertices[static_cast<std::size_t>(corner[1])];
  const Vec3& c = mesh.vertices[static_cast<std::size_t>(corner[2])];
  return (b - a).cross(c - a);
}

/// Returns the unit normal of each triangle; zero for a triangle without area.
std::vector<Vec3> face_normals(const TriangleMesh& mesh);
/// Returns the normal of each vertex: the sum of the normals of its triangles, weighted by their angles at the vertex,
/// as a unit vector. It is zero if the normals cancel.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh, const std::vector<Vec3>& normals);

/// Returns the enclosed volume: the signed sum over the tetrahedra formed by the first vertex and each triangle. It is
/// negative if the mesh is inside out.
/// In      mesh  mesh with at least one vertex
double volume_m3(const TriangleMesh& mesh);
double area_m2(const TriangleMesh& mesh);

}  // namespace tandem::geometry
