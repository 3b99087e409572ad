// Convex polygons in a plane: what a linear distance leaves of them, and their moments.
#pragma once

#include <Eigen/Core>
#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <span>
#include <utility>

#include "common/contact/flat/flat_node.hpp"
#include "common/contact/flat/plane_map.hpp"

namespace tandem::contact {

/// Its corners, anticlockwise; fewer than three: it is empty. Each cut adds one at most.
using Polygon = boost::container::static_vector<Eigen::Vector2d, kMaxFlatCorners + PlaneMap::kMaxInBox + 6>;

/// A distance that is linear over a plane: middle + u · along + v · across.
using DepthSlope = Eigen::Vector3d;

/// Of an area, the products of (1, u, v) with each other, summed up.
using AreaMoments = Eigen::Matrix3d;

inline double at(const DepthSlope& slope, const Eigen::Vector2d& p) {
  return slope[0] + slope[1] * p.x() + slope[2] * p.y();
}
/// What is below `distance_m`.
inline DepthSlope below(const DepthSlope& slope, double distance_m) {
  return slope - distance_m * DepthSlope::UnitX();
}

/// The rectangle about (0, 0).
Polygon rectangle(const Eigen::Vector2d& half_m);
/// A flat node's, about its mean.
Polygon corners_of(const FlatNode& flat);
/// A polygon in places, that are not on one line, beyond which none of them is by more than `lost_m`; empty, if it would
/// need more than kMaxFlatCorners.
Polygon polygon_in_places(std::span<const Eigen::Vector2d> places, double lost_m);
/// The smallest rectangle around it has a side along this unit vector.
Eigen::Vector2d axis_of_box(const Polygon& polygon);

inline bool is_empty(const Polygon& polygon) {
  return polygon.size() < 3;
}
/// Leaves what is not above 0: mostly all of it, or nothing.
void cut(Polygon& polygon, const DepthSlope& slope);
/// The least and the most.
std::pair<double, double> range(const Polygon& polygon, const DepthSlope& slope);
AreaMoments moments_of(const Polygon& polygon);
Eigen::Vector2d mean_of(const AreaMoments& moments);
Eigen::Matrix2d covariance_of(const AreaMoments& moments);

}  // namespace tandem::contact
