// The order of a shell's points: those of one flat part of the surface, or of one straight edge, follow each other, so
// that nodes of the tree over them are flat and are rectangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::contact {

struct ShellPoint;

/// Puts points into the order of a tree: of what is not flat by halves along the axes of S, then of each flat part by
/// halves along its own sides.
void order_by_parts(std::vector<ShellPoint>& points);

/// Where points of one flat part begin or end, of points in that order: indices that rise, without the first and the last.
std::vector<std::uint32_t> borders_of_parts(std::span<const ShellPoint> points);

/// The axes of the smallest rectangle around points, about: its sides, and the normal of the plane that fits them best.
Eigen::Matrix3d axes_of_rectangle(std::span<const ShellPoint> points, const Eigen::Matrix3d& covariance);

}  // namespace tandem::contact
