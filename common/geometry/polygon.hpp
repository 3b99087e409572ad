// Polygons in a plane: areas, intersections, triangles.
#pragma once

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::geometry {

using Vec2 = Eigen::Vector2d;
using Triangle2 = std::array<Vec2, 3>;

inline constexpr std::size_t kMaxConvexCorners = 16;
/// A convex polygon; counterclockwise, if not stated otherwise.
using ConvexPolygon = boost::container::static_vector<Vec2, kMaxConvexCorners>;

/// Returns the signed area: positive if the corners are counterclockwise.
double signed_area(std::span<const Vec2> polygon) noexcept;
/// Returns the centre of the area; the first corner for a polygon without an area.
Vec2 centroid(std::span<const Vec2> polygon) noexcept;
/// Returns whether the polygon is convex and counterclockwise, without three corners on a line.
bool is_convex(std::span<const Vec2> polygon) noexcept;
/// Returns the area of the intersection of two convex, counterclockwise polygons with at most kMaxConvexCorners corners.
double common_area(std::span<const Vec2> a, std::span<const Vec2> b) noexcept;
/// Divides a simple, counterclockwise polygon into triangles. Returns none if it crosses itself.
/// Model   ear clipping, O(n³) for n corners
std::vector<Triangle2> triangulate(std::span<const Vec2> polygon);

}  // namespace tandem::geometry
