// Computes the exact overlap depth of two meshes, as a reference for the contact search. Every vertex and every edge of
// each mesh is tested against the other mesh. The only code shared with the contact search is the exact distance query.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "lab/studies/contact/mesh_generators.hpp"

namespace tandem::lab {

/// A mesh prepared for exact distance queries: the surface of a solid, or the mid-surface of a plate. S is the frame of
/// the mesh.
class ExactSurface {
 public:
  /// Prepares the surface of a body.
  /// In      half_thickness_m  half the thickness of a plate, which consists of all points within this distance of the
  ///         mesh; 0: the body is a solid
  ///         beside            surface of the body's open parts (sheets), which belongs to the same body; may be null
  ///         inner surfaces inside a solid; see geometry::ContactMesh
  explicit ExactSurface(const geometry::TriangleMesh& mesh, double half_thickness_m = 0,
                        std::shared_ptr<const ExactSurface> beside = nullptr, const geometry::TriangleMesh& inner = {});

  /// Returns this surface and the surface given as `beside`.
  std::vector<const ExactSurface*> parts() const;

  const geometry::TriangleTree& tree() const { return tree_; }
  double half_thickness_m() const { return half_thickness_m_; }
  /// Returns the point of the mesh nearest to `p_S`, with its triangle, normal and distance. Triangle −1 means that no
  /// point of the mesh lies within `limit_m`. The distance is negative inside a solid. For a plate it is the distance
  /// to the mid-surface.
  geometry::TriangleTree::Closest closest(const Vec3& p_S, double limit_m) const;
  std::span<const Vec3> corners() const { return corners_; }  ///< vertices that belong to a triangle
  std::span<const std::array<Vec3, 2>> edges() const { return edges_; }
  /// Returns whether a ball about `p_S` intersects the bounding box.
  bool may_touch(const Vec3& p_S, double radius_m) const;
  /// Returns the signed distance to the body, including `beside`. It is infinite if its magnitude reaches `limit_m`,
  /// even for a point inside the body.
  double distance_m(const Vec3& p_S, double limit_m) const;
  /// Returns `count` points distributed over the surface in proportion to area. The same seed gives the same points.
  std::vector<Vec3> samples(std::size_t count, std::uint64_t seed) const;

 private:
  geometry::TriangleMesh mesh_;
  double half_thickness_m_;
  geometry::TriangleTree tree_;
  Eigen::AlignedBox3d bounds_;
  std::vector<Vec3> corners_;
  std::vector<std::array<Vec3, 2>> edges_;
  std::shared_ptr<const ExactSurface> beside_;
};

/// A point of one surface that lies inside the other body.
struct OverlapPoint {
  Vec3 p_W = Vec3::Zero();
  double depth_m = 0;  ///< distance from the point to the surface of the other body
};

/// Maximum distance between samples on an edge.
inline constexpr double kOverlapEdgeStep_m = 5e-5;
/// Default search depth. Points at larger depths are not found; this limits the cost.
inline constexpr double kDeepestOverlap_m = 3e-3;

/// Returns all vertices of both meshes, and samples of all their edges, that lie inside the other body.
/// In      shallowest_m  points with a smaller depth are omitted
///         deepest_m     points with a larger depth are not found
/// Cost    milliseconds to seconds
std::vector<OverlapPoint> overlap_points(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b,
                                         const Pose& X_WB, double shallowest_m = 0,
                                         double deepest_m = kDeepestOverlap_m);
/// Returns the depth of the deepest point of overlap_points(), or 0 if there is none. This function is much faster than
/// overlap_points().
double deepest_overlap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB,
                         double shallowest_m = 0, double deepest_m = kDeepestOverlap_m);

/// Returns the distance between two meshes that do not overlap, measured at their vertices only.
double corner_gap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB);

}  // namespace tandem::lab
