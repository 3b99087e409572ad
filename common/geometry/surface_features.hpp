// What a spread of points would step over: sharp edges and their corners.
#pragma once

#include <span>
#include <vector>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/sample_grid.hpp"

namespace tandem::geometry {

/// What features are found in; everything of the same mesh.
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
  /// Angle between the normals of its triangles [rad], positive where the surface is convex; 0 at a border.
  double fold_rad(const MeshEdge& edge) const;
};

/// Samples along the edges that are folded outwards by more than `angle_rad`, `spacing_m` apart along them, and where
/// such edges end, meet or turn. Edges that are folded inwards cannot touch anything first.
///
/// Out     no two that face the same way are nearer than 0.4 spacings
std::vector<SurfaceSample> sharp_samples(const SurfaceTopology& surface, double angle_rad, double spacing_m);

}  // namespace tandem::geometry
