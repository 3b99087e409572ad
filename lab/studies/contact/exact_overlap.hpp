// How deep two meshes overlap, found without any of the code under test except the exact distance to a mesh: every
// corner and every edge of each against the other.
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

/// A mesh prepared for exact questions: the surface of a solid, or the middle of a plate. S: the frame of the mesh.
class ExactSurface {
 public:
  /// In      half_thickness_m  of the plate, which is all that is no farther from the mesh; 0: a solid
  ///         beside            what else is of the body: of a solid, its open parts; may be null
  ///         inner             of a solid: see geometry::ContactMesh
  explicit ExactSurface(const geometry::TriangleMesh& mesh, double half_thickness_m = 0,
                        std::shared_ptr<const ExactSurface> beside = nullptr, const geometry::TriangleMesh& inner = {});

  /// This one, and what is beside it.
  std::vector<const ExactSurface*> parts() const;

  const geometry::TriangleTree& tree() const { return tree_; }
  double half_thickness_m() const { return half_thickness_m_; }
  /// The nearest place of the mesh, with the direction that leads out of the body from there; triangle −1: none within
  /// `limit_m`. Its distance is negative inside a solid; of a plate it is that to its middle.
  geometry::TriangleTree::Closest closest(const Vec3& p_S, double limit_m) const;
  std::span<const Vec3> corners() const { return corners_; }  ///< those that triangles use
  std::span<const std::array<Vec3, 2>> edges() const { return edges_; }
  /// Whether a ball about `p_S` meets the bounding box.
  bool may_touch(const Vec3& p_S, double radius_m) const;
  /// Signed distance to the body and what is beside it where it is less than `limit_m`, else infinite, inside too.
  double distance_m(const Vec3& p_S, double limit_m) const;
  /// `count` points spread over the surface by area, the same for the same seed.
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

/// A point of one surface inside the other.
struct OverlapPoint {
  Vec3 p_W = Vec3::Zero();
  double depth_m = 0;  ///< distance to the surface that it is inside of
};

/// Between samples of an edge.
inline constexpr double kOverlapEdgeStep_m = 5e-5;
/// Points with more depth are not seen, where nothing else is said: bounds the cost.
inline constexpr double kDeepestOverlap_m = 3e-3;

/// All corners of both meshes, and samples of all their edges, that lie inside the other mesh.
/// In      shallowest_m  points with less depth are left out; with more than deepest_m they are not seen
/// Cost    milliseconds to seconds
std::vector<OverlapPoint> overlap_points(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b,
                                         const Pose& X_WB, double shallowest_m = 0,
                                         double deepest_m = kDeepestOverlap_m);
/// The largest depth of those, 0 without any; much faster than asking for all.
double deepest_overlap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB,
                         double shallowest_m = 0, double deepest_m = kDeepestOverlap_m);

/// Distance between meshes that do not overlap, by their corners.
double corner_gap_m(const ExactSurface& a, const Pose& X_WA, const ExactSurface& b, const Pose& X_WB);

}  // namespace tandem::lab
