// Finds sharp edges and corners of a mesh, which evenly distributed samples would miss.
#pragma once

#include <span>
#include <vector>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/sample_grid.hpp"

namespace tandem::geometry {

/// A mesh with the adjacency and the normals required for feature detection.
struct SurfaceTopology {
  explicit SurfaceTopology(const TriangleMesh& its_mesh);

  const TriangleMesh& mesh;
  std::vector<MeshEdge> edges;
  std::vector<Vec3> face_normals;
  std::vector<Vec3> vertex_normals;

  const Vec3& vertex(int index) const { return mesh.vertices[static_cast<std::size_t>(index)]; }
  const Vec3& face_normal(int index) const { return face_normals[static_cast<std::size_t>(index)]; }
  /// Returns the mean of the normals of the edge's triangles: a unit vector, or zero if the normals cancel out.
  Vec3 edge_normal(const MeshEdge& edge) const;
  /// Returns the angle between the normals of the edge's triangles [rad]; positive if the surface is convex there, 0 at
  /// a border.
  double fold_rad(const MeshEdge& edge) const;
};

/// Returns samples on convex edges with an angle above `angle_rad`. Such edges are joined to lines, and samples are at
/// most `spacing_m` apart along a line. Ends, junctions and bends of lines get samples, too. Concave edges get none,
/// because another surface touches their faces first.
///
/// Out     samples; those with normals in similar directions are at least 0.4 spacings apart
std::vector<SurfaceSample> sharp_samples(const SurfaceTopology& surface, double angle_rad, double spacing_m);

}  // namespace tandem::geometry
