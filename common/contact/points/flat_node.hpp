// Flat nodes: nodes of a shell whose points lie on one plane. Their depth below the other shape's plane depends
// linearly on the position. A few points can therefore represent all points of the node.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/contact/field/oriented_box.hpp"

namespace tandem::contact {

struct ShellNode;
struct ShellPoint;

/// Largest number of corners of a flat node's polygon.
inline constexpr std::size_t kMaxFlatCorners = 8;

/// Moments of a node's points that lie within a few micrometres of a plane, and their polygon.
///
/// Model   Four points at mean ± deviations, each with a quarter of the area, have the same area, mean and covariance
///         as all points of the node. A pressure that is linear over the node thus has the same force and moment. If
///         the points cover a convex polygon evenly, four points can also represent any part of the polygon
struct FlatNode {
  Eigen::Vector3f mean_S = Eigen::Vector3f::Zero();
  /// Unit vectors in the plane: the axes of the covariance; for a polygon, the sides of its smallest enclosing
  /// rectangle.
  Eigen::Vector3f along_S = Eigen::Vector3f::UnitX();
  Eigen::Vector3f across_S = Eigen::Vector3f::UnitY();
  float deviation_along_m = 0;
  float deviation_across_m = 0;
  /// Centre of a box around the points and the polygon, in S. The box's edges are along the axes above and their
  /// normal.
  Eigen::Vector3f centre_S = Eigen::Vector3f::Zero();
  Eigen::Vector3f half_m = Eigen::Vector3f::Zero();
  std::uint32_t corner_count = 0;  ///< number of corners of the polygon; 0: no polygon
  /// Corners relative to the mean (along, across), anticlockwise.
  std::array<Eigen::Vector2f, kMaxFlatCorners> corners_m = {};

  bool is_polygon() const { return corner_count > 0; }
  /// Returns whether the four points at mean ± deviations are inside the box. One of them may be outside if a few
  /// points of the node are far from all others.
  bool has_four_inside() const;
  OrientedBox box_S() const;
};

/// Divides the points of a node into four consecutive ranges, one for each of the four points at mean ± deviations.
/// Returns the five borders of the ranges. These are borders of subtrees, so the points of a range are near each other.
std::array<std::uint32_t, 5> quarters_of(const ShellNode& node);

/// Finds the flat nodes of a tree, among the nodes with more points than a leaf. All nodes below a flat node are flat,
/// too.
///
/// Out     nodes  ShellNode::flat is set
std::vector<FlatNode> find_flat_nodes(std::span<const ShellPoint> points, std::span<ShellNode> nodes);

}  // namespace tandem::contact
