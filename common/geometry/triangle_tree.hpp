// Exact distance to a mesh. It is used to compute distance grids, and as the reference in tests.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

/// Bounding-volume hierarchy over the triangles of a mesh. It is immutable, and a query allocates nothing.
///
/// Thread  any number of threads at the same time
class TriangleTree {
 public:
  /// In      mesh  mesh with at least one triangle; not referenced afterwards
  explicit TriangleTree(const TriangleMesh& mesh);
  /// Builds a tree for closest_of_solid(), for a mesh that may have overlapping parts, parts that cross themselves, or
  /// unpaired edges. Such a mesh needs up to three times the memory.
  ///
  /// In      inner    triangles inside the solid that are used only for its winding number; may be empty
  ///         threads  number of threads used for building; the tree does not depend on it
  static TriangleTree of_solid(const TriangleMesh& mesh, const TriangleMesh& inner, int threads = 1);
  TriangleTree(TriangleTree&& other) noexcept;
  TriangleTree& operator=(TriangleTree&& other) noexcept;
  ~TriangleTree();

  struct Closest {
    Vec3 point_S = Vec3::Zero();
    /// Distance to the closest point, ≥ 0; infinite if there is no point within the limit.
    double distance_m = std::numeric_limits<double>::infinity();
    int triangle = -1;
    Vec3 normal_S = Vec3::Zero();  ///< angle-weighted pseudo-normal of the closest face, edge or corner; not normalised
  };
  /// Returns the closest point of the surface; an empty result if its distance is not below `limit_m`.
  /// In      hint  triangle that is probably near, such as the result for a neighbouring point; −1: none
  Closest closest(const Vec3& p_S, double limit_m = std::numeric_limits<double>::infinity(),
                  int hint = -1) const noexcept;
  /// Returns the closest point of the solid's surface, with a normal that points out of the solid. For a tree that
  /// of_solid() did not build, the result is that of closest().
  /// * Overlapping closed parts are treated as their union: if several parts contain `p_S`, the result is on the part
  ///   in which `p_S` is deepest.
  /// * A part that is inside out is a cavity of the smallest part around it.
  /// * If a part crosses itself or has unpaired edges, the winding number classifies its sides. Triangles with the
  ///   inside on both sides are ignored.
  Closest closest_of_solid(const Vec3& p_S, double limit_m = std::numeric_limits<double>::infinity(),
                           int hint = -1) const noexcept;
  /// Returns whether the tree treats parts of the mesh separately. It does so for parts whose bounding boxes overlap,
  /// whose triangles cross each other, or which have unpaired edges.
  bool may_overlap() const { return parts_ != nullptr; }
  /// A triangle of the mesh with the corners a, a + ab, a + ac.
  struct Near {
    int triangle = -1;
    Vec3 a, ab, ac;
  };
  /// Finds triangles within `limit_m` of a point, in no particular order, up to the size of the span.
  /// Out     number of triangles; if it exceeds the size of the span, some triangles are missing
  std::size_t within(const Vec3& p_S, double limit_m, std::span<Near> found) const noexcept;
  /// Finds triangles whose bounding boxes intersect a box. The results are as in within() for a point.
  std::size_t within(const Eigen::AlignedBox3d& box_S, std::span<Near> found) const noexcept;
  /// Finds triangles that the line through `p_S` crosses, on both sides of `p_S`. The results are as in within().
  /// Triangles parallel to the line are excluded.
  std::size_t crossed(const Vec3& p_S, const Vec3& along, std::span<Near> found) const noexcept;
  /// Returns the signed distance to a solid, which is negative inside.
  ///
  /// Model   The sign is that of (p − c)·n, with the pseudo-normal n at the closest point c, see closest_of_solid()
  /// Source  Baerentzen & Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005
  double signed_distance_m(const Vec3& p_S) const noexcept;

  std::size_t triangle_count() const { return triangle_of_slot_.size(); }

 private:
  struct Node;
  struct Nearest;
  struct Builder;
  struct Parts;

  void build_nodes(const TriangleMesh& mesh);
  void store_triangles(const TriangleMesh& mesh);
  void sum_corner_normals(const TriangleMesh& mesh);
  void sum_edge_normals(const TriangleMesh& mesh);
  void find_parts(const TriangleMesh& mesh, const TriangleMesh& inner, int threads);
  static bool may_cross(const Node& node, Eigen::Index child, const Vec3& p_S, const Vec3& along) noexcept;
  bool try_triangle(std::uint32_t slot, const Vec3& p_S, Nearest& best) const noexcept;
  void descend(const Vec3& p_S, Nearest& best) const noexcept;
  Vec3 pseudo_normal(std::uint32_t slot, int feature) const noexcept;

  // Triangles are stored in the order of the leaves: slot i contains triangle triangle_of_slot_[i] of the mesh.
  std::vector<Node> nodes_;
  std::uint32_t root_ = 0;                    ///< link to the root, see Node::links
  std::vector<std::array<Vec3, 3>> corners_;  ///< for each slot: corner a, and the sides ab and ac
  std::vector<std::uint32_t> triangle_of_slot_;
  std::vector<std::uint32_t> slot_of_triangle_;
  std::vector<std::array<std::uint32_t, 3>> vertices_of_slot_;
  std::vector<std::array<std::uint32_t, 3>> edges_of_slot_;
  std::vector<Vec3> vertex_normals_;
  std::vector<Vec3> edge_normals_;
  std::shared_ptr<const Parts> parts_;  ///< parts of the mesh; null if may_overlap() is false
};

}  // namespace tandem::geometry
