// Nodes of a shell whose points lie on one plane: where their depths are linear in their place, few points act as all.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/distance_field.hpp"

namespace tandem::contact {

struct ShellNode;
struct ShellPoint;

/// A box at any angle.
struct OrientedBox {
  Vec3 centre = Vec3::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< unit columns
  Vec3 half_m = Vec3::Zero();

  OrientedBox moved(const Eigen::Matrix3d& R_FB, const Vec3& p_FB) const {
    return {R_FB * centre + p_FB, R_FB * axes, half_m};
  }
  /// Of n·p over the box: from the middle to the most.
  double reach_m(const Vec3& normal) const { return (axes.transpose() * normal).cwiseAbs().dot(half_m); }
};

/// The largest distance to some planes of a field; of none, minus infinity.
double largest_m(std::span<const FieldPlane> planes, PlaneSet set, const Vec3& p);

/// Of planes of a field those whose distance may be the largest somewhere in a box.
PlaneSet largest_over(std::span<const FieldPlane> planes, PlaneSet set, const OrientedBox& box);

/// Of the polygon that a flat node is.
inline constexpr std::size_t kMaxFlatCorners = 8;

/// The points of a node that lie within a few micrometres of a plane.
///
/// Model   area, mean and covariance of the points; four points, each with a quarter of the area, at mean ± deviations
///         have the same, so that a force that is linear over the node has the same sum and moment. Or the convex polygon
///         that they cover evenly, of which that is true of each part
struct FlatNode {
  Eigen::Vector3f mean_S = Eigen::Vector3f::Zero();
  /// Unit, in the plane: the axes of the covariance; of a polygon, along the smallest box.
  Eigen::Vector3f along_S = Eigen::Vector3f::UnitX();
  Eigen::Vector3f across_S = Eigen::Vector3f::UnitY();
  float deviation_along_m = 0;
  float deviation_across_m = 0;
  Eigen::Vector3f centre_S = Eigen::Vector3f::Zero();  ///< of the box around points and polygon, along these axes
  Eigen::Vector3f half_m = Eigen::Vector3f::Zero();
  std::uint32_t corner_count = 0;  ///< 0: it is no polygon
  /// Along and across from the mean, anticlockwise.
  std::array<Eigen::Vector2f, kMaxFlatCorners> corners_m = {};

  bool is_polygon() const { return corner_count > 0; }
  /// Whether the four points are in the box. Where a few points lie far from many, mean − deviation is beyond all of them.
  bool has_four_inside() const;
  OrientedBox box_S() const;
};

/// The share of the four points: of the node's points in order, where the tree divides them and its halves. So each of
/// the four stands for those that are nearest to it.
std::array<std::uint32_t, 5> quarters_of(const ShellNode& node);

/// Of nodes with more points than a leaf, those that are flat, and all below them.
/// Out     in `nodes`, ShellNode::flat
std::vector<FlatNode> find_flat_nodes(std::span<const ShellPoint> points, std::span<ShellNode> nodes);

}  // namespace tandem::contact
