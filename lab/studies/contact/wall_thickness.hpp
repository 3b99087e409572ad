// Wall thickness of a solid, measured along rays from points distributed over its surface.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::lab {

/// Number of sampled points of the surface, independent of the number of triangles.
inline constexpr std::size_t kWallPoints = 8000;

/// Walls behind points distributed evenly over the area, and the share of these points where the solid overlaps
/// itself.
///
/// Model   distance from p against the normal n to the point where the ray leaves the solid, if the surface there is
///         opposite: its normal is within 45° of −n. Faces that meet at an edge bound no wall. The exit is where as
///         many surfaces were left as entered, so overlapping or touching parts are one part, and surfaces inside them
///         do not count
/// Source  rays as in Shapira, Shamir & Cohen-Or, "Consistent mesh partitioning and skeletonisation using the shape
///         diameter function", 2008; they average over a cone, which is not exact for a plate
/// In      solid  closed, with outward normals
/// Out     walls [m], sorted ascending, infinite where no surface is opposite; share, 0 … 1
/// Cost    that of a TriangleTree of it, and about 10 µs a point
std::pair<std::vector<double>, double> walls_of(const geometry::TriangleMesh& solid);

/// The 2 % quantile of the walls: 98 % are thicker; 0: no wall.
double thinnest_wall_m(const std::vector<double>& walls_m);

}  // namespace tandem::lab
