// Convex polygons in a plane: clipping by a linear distance, and moments.
#pragma once

#include <Eigen/Core>
#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <span>
#include <utility>

#include "common/contact/field/plane_map.hpp"
#include "common/contact/points/flat_node.hpp"

namespace tandem::contact {

/// Corners of a polygon, anticlockwise. A polygon with fewer than three corners is empty. The capacity suffices because
/// each cut() adds at most one corner.
using Polygon = boost::container::static_vector<Eigen::Vector2d, kMaxFlatCorners + PlaneMap::kMaxInBox + 6>;

/// A distance that is linear over a plane: s₀ + s₁ u + s₂ v at the coordinates (u, v), with (s₀, s₁, s₂) as the vector.
using DepthSlope = Eigen::Vector3d;

/// Integrals of the products of (1, u, v) with each other over an area.
using AreaMoments = Eigen::Matrix3d;

inline double at(const DepthSlope& slope, const Eigen::Vector2d& p) {
  return slope[0] + slope[1] * p.x() + slope[2] * p.y();
}
/// Returns the slope minus `distance_m`, that is, the distance from a surface farther away by this value.
inline DepthSlope below(const DepthSlope& slope, double distance_m) {
  return slope - distance_m * DepthSlope::UnitX();
}

/// Returns a rectangle centred at (0, 0).
Polygon rectangle(const Eigen::Vector2d& half_m);
/// Returns the polygon of a flat node, relative to the node's mean.
Polygon corners_of(const FlatNode& flat);
/// Returns a convex polygon whose corners are at or near some of the given points. Each point is inside, or at most
/// `lost_m` outside. The points must not be on one line. The result is empty if it would have more than kMaxFlatCorners
/// corners.
Polygon polygon_in_places(std::span<const Eigen::Vector2d> places, double lost_m);
/// Returns a unit vector along a side of the smallest rectangle around the polygon.
Eigen::Vector2d axis_of_box(const Polygon& polygon);

inline bool is_empty(const Polygon& polygon) {
  return polygon.size() < 3;
}
/// Keeps the part of the polygon where the distance is at most 0. In most calls this part is the whole polygon, or
/// nothing; both cases are fast.
void cut(Polygon& polygon, const DepthSlope& slope);
/// Returns the least and the largest distance over the polygon.
std::pair<double, double> range(const Polygon& polygon, const DepthSlope& slope);
AreaMoments moments_of(const Polygon& polygon);
Eigen::Vector2d mean_of(const AreaMoments& moments);
Eigen::Matrix2d covariance_of(const AreaMoments& moments);

}  // namespace tandem::contact
