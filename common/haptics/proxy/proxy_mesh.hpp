// Mesh for the proxy: a tree to find triangles, and normals for shading.
#pragma once

#include <array>
#include <vector>

#include "common/geometry/triangle_tree.hpp"

namespace tandem::haptics {

/// Immutable mesh, shared by the proxies that touch it. It may be open or closed and can be touched from both sides;
/// the orientation of its triangles does not matter.
///
/// Thread  any number of threads at the same time
class ProxyMesh {
 public:
  /// In      mesh  vertices in metres; triangles without area are ignored
  /// Fails   throws std::invalid_argument: no triangle with area, a vertex that is not finite, an index out of range
  explicit ProxyMesh(const geometry::TriangleMesh& mesh);

  const geometry::TriangleTree& tree() const { return tree_; }
  /// Returns the unit normals, at a triangle's corners, of the smooth surface that the mesh approximates.
  const std::array<Eigen::Vector3f, 3>& normals_of(int triangle) const {
    return normals_[static_cast<std::size_t>(triangle)];
  }
  std::size_t triangle_count() const { return normals_.size(); }

 private:
  ProxyMesh(const geometry::TriangleMesh& checked, double crease_cosine);

  geometry::TriangleTree tree_;
  std::vector<std::array<Eigen::Vector3f, 3>> normals_;
};

}  // namespace tandem::haptics
