// Sharp edges and corners of a mesh, which evenly spread samples would miss.
#pragma once

#include <span>
#include <vector>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/sample_grid.hpp"

namespace tandem::geometry {

/// A mesh with the adjacency and normals that feature detection needs.
struct SurfaceTopology {
  explicit SurfaceTopology(const TriangleMesh& its_mesh);

  const TriangleMesh& mesh;
  std::vector<MeshEdge> edges;
  std::vector<Vec3> face_normals;
  std::vector<Vec3> vertex_normals;

  const Vec3& vertex(int index) const { return mesh.vertices[static_cast<std::size_t>(index)]; }
  const Vec3& face_normal(int index) const { return face_normals[static_cast<std::size_t>(index)]; }
  /// Mean of the normals of the edge's triangles; unit, or zero.
  Vec3 edge_normal(const MeshEdge& edge) const;
  /// Angle between the normals of the edge's triangles [rad], positive where the surface is convex; 0 at a border.
  double fold_rad(const MeshEdge& edge) const;
};

/// Returns samples on convex edges that are folded by more than `angle_rad`. Samples are `spacing_m` apart along each
/// line of edges, and at its ends, junctions and turns. Concave edges are left out because they cannot touch anything
/// first.
///
/// Out     two samples that face the same way are at least 0.4 spacings apart
std::vector<SurfaceSample> sharp_samples(const SurfaceTopology& surface, double angle_rad, double spacing_m);

}  // namespace tandem::geometry
