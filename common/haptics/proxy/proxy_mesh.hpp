// A mesh as the proxy meets it: a tree to find triangles, and normals to shade them by.
#pragma once

#include <array>
#include <vector>

#include "common/geometry/triangle_tree.hpp"

namespace tandem::haptics {

/// Immutable; shared by the proxies that touch it. Open or closed, touchable from both sides; which way triangles are
/// turned does not matter.
///
/// Thread  any, at the same time
class ProxyMesh {
 public:
  /// In      mesh  metres; triangles without area are left out
  /// Fails   std::invalid_argument: none left, a vertex that is not finite, an index out of range
  explicit ProxyMesh(const geometry::TriangleMesh& mesh);

  const geometry::TriangleTree& tree() const { return tree_; }
  /// Unit normals of the smooth surface that a triangle stands for, at its corners.
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
