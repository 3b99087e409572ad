// Order of a shell's points: those of one flat part of the surface, or of one straight edge, are consecutive. Nodes of
// the tree over them are then flat rectangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::contact {

struct ShellPoint;

/// Sorts points into the order of a tree by recursive halving: first the points outside flat parts, along the axes of
/// S, then the points of each flat part, along its sides.
void order_by_parts(std::vector<ShellPoint>& points);

/// Returns the borders of the flat parts among points that order_by_parts() has sorted: ascending indices, without 0
/// and the number of points.
std::vector<std::uint32_t> borders_of_parts(std::span<const ShellPoint> points);

/// Returns the approximate axes of the smallest rectangle around points: its sides, and the normal of the best-fitting
/// plane.
Eigen::Matrix3d axes_of_rectangle(std::span<const ShellPoint> points, const Eigen::Matrix3d& covariance);

}  // namespace tandem::contact
