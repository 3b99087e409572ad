// Which triangles meet at which edge: what repair and feature detection walk along.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// An edge of a mesh with its (at most) two triangles.
struct MeshEdge {
  int a = 0;
  int b = 0;
  int left = -1;   ///< triangle that runs a → b; −1: none
  int right = -1;  ///< the other one; −1: none, a border
};

/// One use of an edge by a triangle.
struct HalfEdge {
  int triangle = 0;
  int side = 0;  ///< from corner `side` to the next
};

/// All uses of all edges, those of one edge beside each other; in a fixed order.
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

/// The corner where a half-edge starts.
inline int start_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>(half.side)];
}
/// The corner where it ends.
inline int end_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>((half.side + 1) % 3)];
}
/// The corner that it leaves out.
inline int apex_of(const TriangleMesh& mesh, const HalfEdge& half) {
  return mesh.triangles[static_cast<std::size_t>(half.triangle)][static_cast<std::size_t>((half.side + 2) % 3)];
}

/// The edges of a repaired mesh. Where a mesh that is not has more than two triangles at an edge, they are taken two
/// by two.
std::vector<MeshEdge> mesh_edges(const TriangleMesh& mesh);

/// Of triangles that share vertices: which part each is of, numbered by their first ones.
std::vector<std::size_t> parts_by_vertices(const TriangleMesh& mesh);

/// The connected regions of some triangles, in the order of their first ones. Two are connected by an edge that no third one has and
/// that they run along in opposite directions: so they face the same way.
///
/// In      edges  of each triangle, from its first corner on, by any numbers
std::vector<std::vector<int>> regions_by_edges(const TriangleMesh& mesh,
                                               std::span<const std::array<std::uint32_t, 3>> edges,
                                               const std::vector<bool>& is_one_of_them);

/// These triangles alone, and the vertices that they use. As long as there are few, what others there are costs nothing.
TriangleMesh part_of(const TriangleMesh& mesh, std::span<const int> triangles);

std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t triangle);

/// Cross product of two sides: twice the area, along the normal.
inline Vec3 doubled_area(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& corner = mesh.triangles[triangle];
  const Vec3& a = mesh.vertices[static_cast<std::size_t>(corner[0])];
  const Vec3& b = mesh.vertices[static_cast<std::size_t>(corner[1])];
  const Vec3& c = mesh.vertices[static_cast<std::size_t>(corner[2])];
  return (b - a).cross(c - a);
}

/// Unit normal of each triangle; zero for one without area.
std::vector<Vec3> face_normals(const TriangleMesh& mesh);
/// Normal of each vertex, weighted by the angle of each triangle there; unit, or zero where they cancel.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh, const std::vector<Vec3>& normals);

/// Of the tetrahedra from its first vertex to all triangles, negative where they face it.
/// In      mesh  has a vertex
double volume_m3(const TriangleMesh& mesh);
double area_m2(const TriangleMesh& mesh);

}  // namespace tandem::geometry
