// Mesh modifications and measurements for tests of mesh repair and of surface sampling.
#pragma once

#include "common/base/random.hpp"
#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::contact {

inline void append(geometry::TriangleMesh& mesh, const geometry::TriangleMesh& other,
                   const Vec3& moved_by = Vec3::Zero()) {
  const auto first = static_cast<int>(mesh.vertices.size());
  for (const Vec3& p : other.vertices) mesh.vertices.push_back(p + moved_by);
  for (const auto& t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

inline geometry::TriangleMesh turned(geometry::TriangleMesh mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

inline double enclosed_m3(const geometry::TriangleMesh& mesh) {
  double sum = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    sum += mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][0])].dot(geometry::doubled_area(mesh, i)) / 6;
  }
  return sum;
}

/// Returns true if every edge has exactly two triangles that traverse it in opposite directions.
inline bool is_closed(const geometry::TriangleMesh& mesh) {
  const geometry::EdgeUses edges(mesh);
  for (std::size_t edge = 0; edge < edges.edge_count(); ++edge) {
    const auto uses = edges.uses(edge);
    if (uses.size() != 2 || geometry::start_of(mesh, uses[0]) != geometry::end_of(mesh, uses[1])) return false;
  }
  return true;
}

/// Returns a square in the plane z = 0, divided into a grid of squares. Each vertex is raised to height(x, y).
template <typename Height>
geometry::TriangleMesh height_field(double size_m, int squares, Height&& height) {
  geometry::TriangleMesh mesh;
  for (int j = 0; j <= squares; ++j) {
    for (int i = 0; i <= squares; ++i) {
      const double x = size_m * (static_cast<double>(i) / squares - 0.5);
      const double y = size_m * (static_cast<double>(j) / squares - 0.5);
      mesh.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (int j = 0; j < squares; ++j) {
    for (int i = 0; i < squares; ++i) {
      const int a = j * (squares + 1) + i;
      const int d = a + squares + 1;
      mesh.triangles.push_back({a, a + 1, d + 1});
      mesh.triangles.push_back({a, d + 1, d});
    }
  }
  return mesh;
}

/// A point on the surface with the normal of its triangle.
struct SurfacePoint {
  Vec3 p = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
};

/// Returns a random point on one triangle, with uniform distribution.
inline SurfacePoint random_point(const geometry::TriangleMesh& mesh, std::size_t triangle, Random& random) {
  const auto& corner = mesh.triangles[triangle];
  double u = random.uniform();
  double v = random.uniform();
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  const Vec3& a = mesh.vertices[static_cast<std::size_t>(corner[0])];
  const Vec3& b = mesh.vertices[static_cast<std::size_t>(corner[1])];
  const Vec3& c = mesh.vertices[static_cast<std::size_t>(corner[2])];
  return {a + u * (b - a) + v * (c - a), geometry::doubled_area(mesh, triangle).normalized()};
}

}  // namespace tandem::contact
