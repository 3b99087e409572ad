// Points of one plane: their moments and axes, and the convex polygon that they cover.
#pragma once

#include <optional>
#include <span>

#include "common/base/spatial.hpp"
#include "common/contact/flat/flat_node.hpp"

namespace tandem::contact {

struct PointShell;

/// Of one plane: points are rounded to less than 1 µm along each axis.
inline constexpr double kFlat_m = 3e-6;

/// Sums over points weighted by their area, taken about the first of them.
struct Moments {
  double area_m2 = 0;
  Vec3 mean = Vec3::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

Moments moments_of(std::span<const ShellPoint> points);

/// About the points, along these axes.
OrientedBox box_along(std::span<const ShellPoint> points, const Eigen::Matrix3d& axes);

/// The rectangle that is `box`, if the points cover it evenly: mean and covariance are the rectangle's, each of its cells
/// has its share of their area, and each part of it that is twice as wide as they are apart, a point.
std::optional<FlatNode> rectangle_of(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments,
                                     const OrientedBox& box);
/// A convex polygon with the mean and the covariance of the points, if they cover one evenly.
std::optional<FlatNode> polygon_of(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments);
/// What is no polygon, by the moments of its points.
FlatNode node_as_it_is(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments);

/// Nodes that are polygons, but reach beyond the surface of `field` by more than a tenth of a millimetre, become flat
/// nodes like others. The points alone do not tell: a corner of a rectangle may be as far out as they are from each other.
void drop_polygons_off(const DistanceField& field, PointShell& shell);

}  // namespace tandem::contact
