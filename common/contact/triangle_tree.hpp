// The exact distance to a mesh: what distance grids are sampled from, and what tests hold them against.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "common/contact/triangle_mesh.hpp"

namespace tandem {

/// Bounding-volume tree over the triangles of a mesh. Immutable; a query allocates nothing.
///
/// Thread  any, at the same time
class TriangleTree {
 public:
  /// In      mesh  at least one triangle; it need not live on
  explicit TriangleTree(const TriangleMesh& mesh);

  struct Closest {
    Vec3 point_S = Vec3::Zero();
    double distance_m = std::numeric_limits<double>::infinity();  ///< ≥ 0; infinite: none nearer than the limit
    int triangle = -1;
    Vec3 normal_S = Vec3::Zero();  ///< angle-weighted pseudo-normal of the closest face, edge or corner, not unit
  };
  /// The closest point of the surface, if nearer than `limit_m`.
  /// In      hint  a triangle that is probably near (of a neighbouring query), or −1
  Closest closest(const Vec3& p_S, double limit_m = std::numeric_limits<double>::infinity(),
                  int hint = -1) const noexcept;
  /// Negative inside. For solids.
  ///
  /// Model   sign of (p − c)·n with the pseudo-normal n at the closest point c
  /// Source  Baerentzen & Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005
  double signed_distance_m(const Vec3& p_S) const noexcept;

  std::size_t triangle_count() const;
};

}  // namespace tandem
