// Points of one plane: their moments and axes, and whether they are a rectangle.
#pragma once

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

/// In      mean, deviations, axes  of the points, or of the rectangle that they cover; the first two axes in any order
FlatNode node_along(std::span<const ShellPoint> points, const ShellNode& node, const Vec3& mean, Vec3 deviations,
                    Eigen::Matrix3d axes);
/// What is no rectangle, by the moments of its points.
FlatNode node_as_it_is(std::span<const ShellPoint> points, const ShellNode& node, const Moments& moments);

/// Whether the points have the mean and the covariance of the rectangle that `box` is, each of its cells its share of their
/// area, and each part of it that is twice as wide as they are apart, a point.
bool cover_rectangle(std::span<const ShellPoint> points, const Moments& moments, const OrientedBox& box);

/// Nodes that are rectangles, but reach beyond the surface of `field` by more than a tenth of a millimetre, become flat
/// nodes like others. The points alone do not tell: a corner of a rectangle may be as far out as they are from each other.
void drop_rectangles_off(const DistanceField& field, PointShell& shell);

}  // namespace tandem::contact
