// The exact distance to a mesh: what distance grids are sampled from, and what tests hold them against.
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

/// Bounding-volume tree over the triangles of a mesh. Immutable; a query allocates nothing.
///
/// Thread  any, at the same time
class TriangleTree {
 public:
  /// In      mesh  at least one triangle; it need not live on
  explicit TriangleTree(const TriangleMesh& mesh);
  /// For closest_of_solid() where parts overlap or cross themselves, or faces do not pair up at their edges: takes up to three times
  /// the memory.
  /// In      inner  what lies within the solid, and is no surface of it, but belongs to its winding number; may be empty
  ///         threads  to make it with; the tree does not depend on how many
  static TriangleTree of_solid(const TriangleMesh& mesh, const TriangleMesh& inner, int threads = 1);
  TriangleTree(TriangleTree&& other) noexcept;
  TriangleTree& operator=(TriangleTree&& other) noexcept;
  ~TriangleTree();

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
  /// The same with a normal that leads out of the solid. Where closed parts overlap, that is their union: of those that `p_S` is in,
  /// the closest of the one that it is deepest in. A part that is turned inside out is a cavity of the smallest one around it.
  /// Where a part crosses itself or faces do not pair up, the winding number says what is inside, and what has that on both sides
  /// is no surface. Of a tree that is not of_solid(), the same as closest().
  Closest closest_of_solid(const Vec3& p_S, double limit_m = std::numeric_limits<double>::infinity(),
                           int hint = -1) const noexcept;
  /// Whether boxes around parts overlap, or faces do not pair up at their edges or cross others.
  bool may_overlap() const { return parts_ != nullptr; }
  /// A triangle of the mesh with its corners a, a + ab, a + ac.
  struct Near {
    int triangle = -1;
    Vec3 a, ab, ac;
  };
  /// The triangles that are not farther than `limit_m`, in no special order, as many as the span holds.
  /// Out     how many; more than the span holds: there are others
  std::size_t within(const Vec3& p_S, double limit_m, std::span<Near> found) const noexcept;
  /// The triangles whose boxes meet a box, likewise.
  std::size_t within(const Eigen::AlignedBox3d& box_S, std::span<Near> found) const noexcept;
  /// The triangles that a line crosses, on both sides of `p_S`, as within() gives them; none that lies along the line.
  std::size_t crossed(const Vec3& p_S, const Vec3& along, std::span<Near> found) const noexcept;
  /// Negative inside. For solids.
  ///
  /// Model   sign of (p − c)·n with the pseudo-normal n at the closest point c, see closest_of_solid()
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

  // Triangles are in the order of the leaves: slot i is triangle triangle_of_slot_[i] of the mesh.
  std::vector<Node> nodes_;
  std::uint32_t root_ = 0;                    ///< a link as in Node
  std::vector<std::array<Vec3, 3>> corners_;  ///< a, ab, ac
  std::vector<std::uint32_t> triangle_of_slot_;
  std::vector<std::uint32_t> slot_of_triangle_;
  std::vector<std::array<std::uint32_t, 3>> vertices_of_slot_;
  std::vector<std::array<std::uint32_t, 3>> edges_of_slot_;
  std::vector<Vec3> vertex_normals_;
  std::vector<Vec3> edge_normals_;
  std::shared_ptr<const Parts> parts_;  ///< see may_overlap(); null: none
};

}  // namespace tandem::geometry
