// Sorts the points of a shell so that those of a flat part of the surface, or of a straight edge, are consecutive.
// Nodes of the tree over the sorted points are then flat rectangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::contact {

struct ShellPoint;

/// Sorts points into the order of a tree, by recursive halving. The points outside flat parts come first; their halving
/// is along the axes of S. The points of each flat part follow; their halving is along the sides of the part's smallest
/// rectangle.
void order_by_parts(std::vector<ShellPoint>& points);

/// Returns the borders between the flat parts of sorted points (order_by_parts()), as ascending indices. The indices 0
/// and points.size() are not included.
std::vector<std::uint32_t> borders_of_parts(std::span<const ShellPoint> points);

/// Returns the approximate axes of the smallest rectangle around points: the directions of its sides, and the normal of
/// the best-fitting plane.
Eigen::Matrix3d axes_of_rectangle(std::span<const ShellPoint> points, const Eigen::Matrix3d& covariance);

}  // namespace tandem::contact
