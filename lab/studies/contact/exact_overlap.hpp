// Exact overlap depth of two meshes: every corner and every edge of each is tested against the other. It shares only
// the exact distance to a mesh with the code under test.
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

/// A mesh prepared for exact distance queries: the surface of a solid, or the mid-surface of a plate. S: the frame of
/// the mesh.
class ExactSurface {
 public:
  /// In      half_thickness_m  half thickness of a plate, whose body is all points within it of the mesh; 0: a solid
  ///         beside            rest of the body: the open parts of a solid; may be null
  ///         inner             inner surfaces of a solid: see geometry::ContactMesh
  explicit ExactSurface(const geometry::TriangleMesh& mesh, double half_thickness_m = 0,
                        std::shared_ptr<const ExactSurface> beside = nullptr, const geometry::TriangleMesh& inner = {});

  /// This surface and the one given as `beside`.
  std::vector<const ExactSurface*> parts() const;

  const geometry::TriangleTree& tree() const { return tree_; }
  double half_thickness_m() const { return half_thickness_m_; }
  /// The nearest point of the mesh, with the direction out of the body from there; triangle −1: none within `limit_m`.
  /// The distance is negative inside a solid; for a plate it is the distance to the mid-surface.
  geometry::TriangleTree::Closest closest(const Vec3& p_S, double limit_m) const;
  std::span<const Vec3> corners() const { return corners_; }  ///< vertices used by triangles
  std::span<const std::array<Vec3, 2>> edges() const { return edges_; }
  /// Whether a ball about `p_S` meets the bounding box.
  bool may_touch(const Vec3& p_S, double radius_m) const;
  /// Signed distance to the body including `beside` where its magnitude is below `limit_m`, otherwise infinite, also
  /// inside.
  double distance_m(const Vec3& p_S, double limit_m) const;
  /// `count` points distributed over the surface by area; the same seed gives the same points.
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
  double depth_m = 0;  ///< distance to the surface of the other body
};

/// Largest distance between samples of an edge.
inline constexpr double kOverlapEdgeStep_m = 5e-5;
/// Default search depth: points deeper than this are not found, which bounds the cost.
inline constexpr double kDeepestOverlap_m = 3e-3;

/// All corners of both meshes, and samples of all their edges, that lie inside the other body.
/// In      shallowest_m  points less deep than this are omitted; points deeper than deepest_m are not found
/// Cost    milliseconds to seconds
std::vector<OverlapPoint> overlap_points(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b,
                                         const Pose& X_WB, double shallowest_m = 0,
                                         double deepest_m = kDeepestOverlap_m);
/// Largest depth of these points, 0 without any; much faster than overlap_points().
double deepest_overlap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB,
                         double shallowest_m = 0, double deepest_m = kDeepestOverlap_m);

/// Distance between meshes that do not overlap, measured at their corners.
double corner_gap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB);

}  // namespace tandem::lab
