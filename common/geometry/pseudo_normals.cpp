// Pseudo-normals of the faces, edges and corners of a mesh. They show whether a point is inside: it is if its offset
// from the nearest face, edge or corner points against the pseudo-normal.
#include <algorithm>
#include <cmath>

#include "common/base/progress.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::geometry {

void TriangleTree::sum_corner_normals(const TriangleMesh& mesh) {
  vertex_normals_.assign(mesh.vertices.size(), Vec3::Zero());
  const auto angle = [](const Vec3& u, const Vec3& v) { return std::atan2(u.cross(v).norm(), u.dot(v)); };
  for (std::size_t slot = 0; slot < corners_.size(); ++slot) {
    call_off_point(slot);
    const auto& [a, ab, ac] = corners_[slot];
    const Vec3 bc = ac - ab;
    const Vec3 normal = ab.cross(ac).normalized();
    const auto& vertices = vertices_of_slot_[slot];
    vertex_normals_[vertices[0]] += angle(ab, ac) * normal;
    vertex_normals_[vertices[1]] += angle(-ab, bc) * normal;
    vertex_normals_[vertices[2]] += angle(ac, bc) * normal;
  }
}

void TriangleTree::sum_edge_normals(const TriangleMesh& mesh) {
  // Edges are stored in linked lists, one for each vertex. The list of a vertex contains its edges to vertices with a
  // larger index, about three on average.
  struct Edge {
    std::uint32_t larger_vertex;
    std::uint32_t next;  ///< next edge with the same smaller vertex
  };
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> first_edge(mesh.vertices.size(), kNone);
  std::vector<Edge> edges;
  edges.reserve(corners_.size() * 3 / 2);
  edge_normals_.reserve(edges.capacity());
  edges_of_slot_.resize(corners_.size());
  for (std::size_t slot = 0; slot < corners_.size(); ++slot) {
    call_off_point(slot);
    const Vec3 normal = corners_[slot][1].cross(corners_[slot][2]).normalized();
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [from, to] = std::minmax(vertices_of_slot_[slot][side], vertices_of_slot_[slot][(side + 1) % 3]);
      std::uint32_t edge = first_edge[from];
      while (edge != kNone && edges[edge].larger_vertex != to) edge = edges[edge].next;
      if (edge == kNone) {
        edge = static_cast<std::uint32_t>(edges.size());
        edges.push_back({to, first_edge[from]});
        first_edge[from] = edge;
        edge_normals_.emplace_back(Vec3::Zero());
      }
      edge_normals_[edge] += normal;
      edges_of_slot_[slot][side] = edge;
    }
  }
}

Vec3 TriangleTree::pseudo_normal(std::uint32_t slot, int feature) const noexcept {
  if (feature == 0) return corners_[slot][1].cross(corners_[slot][2]).normalized();
  if (feature <= 3) return edge_normals_[edges_of_slot_[slot][static_cast<std::size_t>(feature - 1)]];
  return vertex_normals_[vertices_of_slot_[slot][static_cast<std::size_t>(feature - 4)]];
}

}  // namespace tandem::geometry
