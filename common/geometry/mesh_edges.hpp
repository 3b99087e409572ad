// Adjacency of triangles at edges, for repair and feature detection.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// An edge of a mesh with its one or two triangles.
struct MeshEdge {
  int a = 0;
  int b = 0;
  int left = -1;   ///< triangle that runs along the edge from a to b; −1: none
  int right = -1;  ///< second triangle; −1: none, the edge is a border
};

/// One use of an edge by a triangle.
struct HalfEdge {
  int triangle = 0;
  int side = 0;  ///< from corner `side` to the next
};

/// All uses of all edges in a fixed order, with the uses of one edge adjacent.
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

/// Vertex at which a half-edge starts.
inline int start_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>(half.side)];
}
/// Vertex at which a half-edge ends.
inline int end_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>((half.side + 1) % 3)];
}
/// Vertex of the triangle opposite a half-edge.
inline int apex_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>((half.side + 2) % 3)];
}

/// Returns the edges of a repaired mesh. In an unrepaired mesh, the triangles of an edge with more than two are paired
/// in order.
std::vector<MeshEdge> mesh_edges(const TriangleMesh& mesh);

/// Returns the part number of each triangle. Triangles that share a vertex are in one part; parts are numbered by their
/// first triangle.
std::vector<std::size_t> parts_by_vertices(const TriangleMesh& mesh);

/// Returns the connected regions of the selected triangles, ordered by their first triangle. Two triangles are
/// connected by an edge that no third triangle uses. They must traverse it in opposite directions, and so face the same
/// way.
///
/// In      edges  edge numbers of each triangle, from its first corner on; the numbering is arbitrary
std::vector<std::vector<int>> regions_by_edges(const TriangleMesh& mesh,
                                               std::span<const std::array<std::uint32_t, 3>> edges,
                                               const std::vector<bool>& is_one_of_them);

/// Returns the given triangles and their vertices as a mesh. If there are few, the cost does not depend on the size of
/// `mesh`.
TriangleMesh part_of(const TriangleMesh& mesh, std::span<const int> triangles);

std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t triangle);

/// Cross product of two sides: a vector along the normal, twice the area long.
inline Vec3 doubled_area(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& corner = mesh.triangles[triangle];
  const Vec3& a = mesh.vertices[static_cast<std::size_t>(corner[0])];
  const Vec3& b = mesh.vertices[static_cast<std::size_t>(corner[1])];
  const Vec3& c = mesh.vertices[static_cast<std::size_t>(corner[2])];
  return (b - a).cross(c - a);
}

/// Unit normal of each triangle; zero for a triangle without area.
std::vector<Vec3> face_normals(const TriangleMesh& mesh);
/// Normal of each vertex, weighted by the angle of each triangle at it: a unit vector, or zero where the normals
/// cancel.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh, const std::vector<Vec3>& normals);

/// Enclosed volume: the signed sum over the tetrahedra from the first vertex to each triangle. Negative for a mesh
/// turned inside out.
/// In      mesh  has at least one vertex
double volume_m3(const TriangleMesh& mesh);
double area_m2(const TriangleMesh& mesh);

}  // namespace tandem::geometry
