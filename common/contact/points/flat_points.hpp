// Functions for points that lie on one plane: moments, axes, and the convex polygon that the points cover.
#pragma once

#include <optional>
#include <span>

#include "common/base/spatial.hpp"
#include "common/contact/points/flat_node.hpp"

namespace tandem::contact {

struct PointShell;

/// Largest distance of points from their common plane. Points are rounded to less than 1 µm along each axis.
inline constexpr double kFlat_m = 3e-6;

/// Area-weighted moments of points. The sums are computed relative to the first point, to reduce rounding.
struct Moments {
  double area_m2 = 0;
  Vec3 mean = Vec3::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

Moments moments_of(std::span<const ShellPoint> points);

/// Returns the smallest box around the points whose edges are parallel to the columns of `axes`.
OrientedBox box_along(std::span<const ShellPoint> points, const Eigen::Matrix3d& axes);

/// Returns the rectangle of `box` if the points cover it evenly, else nothing. Conditions:
/// * The mean and covariance of the points are those of the rectangle.
/// * The points in each cell of the rectangle have the area of the cell.
/// * Each part of the rectangle that is two spacings of points wide contains a point.
std::optional<FlatNode> rectangle_of(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments,
                                     const OrientedBox& box);
/// Returns a convex polygon with the mean and covariance of the points if they cover it evenly, else nothing.
std::optional<FlatNode> polygon_of(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments);
/// Returns a flat node without a polygon, with the moments of its points.
FlatNode node_as_it_is(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments);

/// Removes the polygon of a flat node if it extends beyond the surface of `field` by more than 0.11 mm. The check
/// samples the polygon itself, because its corners may be one spacing away from the nearest point.
void drop_polygons_off(const DistanceField& field, PointShell& shell);

}  // namespace tandem::contact
