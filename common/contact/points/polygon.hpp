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

/// A distance that depends linearly on the position in a plane: s₀ + s₁ u + s₂ v at the point with coordinates (u, v).
/// The vector is (s₀, s₁, s₂).
using DepthSlope = Eigen::Vector3d;

/// Moments of an area: the integral of m mᵀ over the area, with m = (1, u, v) at the point (u, v).
using AreaMoments = Eigen::Matrix3d;

inline double at(const DepthSlope& slope, const Eigen::Vector2d& p) {
  return slope[0] + slope[1] * p.x() + slope[2] * p.y();
}
/// Returns the distance from a parallel surface that is farther away by `distance_m`: the given distance minus
/// `distance_m`.
inline DepthSlope below(const DepthSlope& slope, double distance_m) {
  return slope - distance_m * DepthSlope::UnitX();
}

/// Returns a rectangle centred at (0, 0).
Polygon rectangle(const Eigen::Vector2d& half_m);
/// Returns the polygon of a flat node. The corners are relative to the mean position of the node's points.
Polygon corners_of(const FlatNode& flat);
/// Returns a simplified convex hull of the given points, which must not all be on one line. A point may be outside by
/// at most `lost_m`. The result is empty if the polygon would have more than kMaxFlatCorners corners.
Polygon polygon_in_places(std::span<const Eigen::Vector2d> places, double lost_m);
/// Returns a unit vector along a side of the smallest rectangle around the polygon.
Eigen::Vector2d axis_of_box(const Polygon& polygon);

inline bool is_empty(const Polygon& polygon) {
  return polygon.size() < 3;
}
/// Cuts off the part of the polygon where the distance `slope` is positive. It is fast if nothing or everything is cut
/// off, as in most calls.
void cut(Polygon& polygon, const DepthSlope& slope);
/// Returns the least and the largest distance over the polygon.
std::pair<double, double> range(const Polygon& polygon, const DepthSlope& slope);
AreaMoments moments_of(const Polygon& polygon);
Eigen::Vector2d mean_of(const AreaMoments& moments);
Eigen::Matrix2d covariance_of(const AreaMoments& moments);

}  // namespace tandem::contact
