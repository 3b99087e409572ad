#include "common/haptics/proxy/proxy_mesh.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "common/base/progress.hpp"
#include "common/geometry/mesh_edges.hpp"

namespace tandem::haptics {
namespace {

/// Triangles with at most this doubled area have no usable normal. The value is the area of a square micrometre.
constexpr double kMinDoubledArea_m2 = 1e-12;
/// Largest angle between neighbouring triangles that are shaded as one smooth surface. At larger angles, the user feels
/// the common edge.
constexpr double kCrease_rad = 0.7;

geometry::TriangleMesh checked(const geometry::TriangleMesh& mesh) {
  geometry::TriangleMesh result{mesh.vertices, {}};
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    call_off_point(i);
    if (!is_finite(mesh.vertices[i])) {
      throw std::invalid_argument("vertex " + std::to_string(i) + " of the mesh is not finite; repair the mesh");
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    call_off_point(i);
    std::array<const Vec3*, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const int index = mesh.triangles[i][k];
      if (index < 0 || static_cast<std::size_t>(index) >= mesh.vertices.size()) {
        throw std::invalid_argument("triangle " + std::to_string(i) + " of the mesh names vertex " +
                                    std::to_string(index) + " of " + std::to_string(mesh.vertices.size()) +
                                    "; repair the mesh");
      }
      corners[k] = &mesh.vertices[static_cast<std::size_t>(index)];
    }
    const double doubled_area = (*corners[1] - *corners[0]).cross(*corners[2] - *corners[0]).norm();
    if (doubled_area > kMinDoubledArea_m2) result.triangles.push_back(mesh.triangles[i]);
  }
  if (result.triangles.empty()) {
    throw std::invalid_argument("the mesh has no triangle with an area; give it in metres, with at least one");
  }
  return result;
}

/// Triangles at each vertex, grouped by vertex.
struct Fans {
  explicit Fans(const geometry::TriangleMesh& mesh) : first(mesh.vertices.size() + 1, 0) {
    for (const auto& triangle : mesh.triangles) {
      for (const int vertex : triangle) ++first[static_cast<std::size_t>(vertex) + 1];
    }
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    triangles.resize(first.back());
    std::vector<std::size_t> next = first;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      call_off_point(i);
      for (const int vertex : mesh.triangles[i]) triangles[next[static_cast<std::size_t>(vertex)]++] = i;
    }
  }
  std::vector<std::size_t> first;
  std::vector<std::size_t> triangles;
};

double angle_at(const geometry::TriangleMesh& mesh, const std::array<int, 3>& triangle, int vertex) {
  const std::size_t k = triangle[0] == vertex ? 0 : triangle[1] == vertex ? 1 : 2;
  const auto corner = [&](std::size_t i) { return mesh.vertices[static_cast<std::size_t>(triangle[i % 3])]; };
  const Vec3 u = corner(k + 1) - corner(k);
  const Vec3 v = corner(k + 2) - corner(k);
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// Returns the smooth normal at a triangle's corner: the normalised sum of the normals of all triangles at this corner,
/// weighted by their angles. Triangles whose normals deviate by more than the crease angle are excluded.
Vec3 smooth_normal(const geometry::TriangleMesh& mesh, const std::vector<Vec3>& flat, const Fans& fans,
                   std::size_t triangle, int vertex, double crease_cosine) {
  Vec3 sum = Vec3::Zero();
  const auto v = static_cast<std::size_t>(vertex);
  for (std::size_t at = fans.first[v]; at < fans.first[v + 1]; ++at) {
    const std::size_t other = fans.triangles[at];
    const double cosine = flat[other].dot(flat[triangle]);
    // A neighbour with the opposite orientation counts as the same surface, seen from its back.
    if (std::abs(cosine) < crease_cosine) continue;
    sum += std::copysign(angle_at(mesh, mesh.triangles[other], vertex), cosine) * flat[other];
  }
  return sum.stableNormalized();
}

}  // namespace

ProxyMesh::ProxyMesh(const geometry::TriangleMesh& mesh) : ProxyMesh(checked(mesh), std::cos(kCrease_rad)) {}

ProxyMesh::ProxyMesh(const geometry::TriangleMesh& mesh, double crease_cosine) : tree_(mesh) {
  const std::vector<Vec3> flat = geometry::face_normals(mesh);
  const Fans fans(mesh);
  normals_.resize(mesh.triangles.size());
  for (std::size_t i = 0; i < normals_.size(); ++i) {
    call_off_point(i);
    for (std::size_t k = 0; k < 3; ++k) {
      normals_[i][k] = smooth_normal(mesh, flat, fans, i, mesh.triangles[i][k], crease_cosine).cast<float>();
    }
  }
}

}  // namespace tandem::haptics
