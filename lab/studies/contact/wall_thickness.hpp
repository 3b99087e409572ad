// Wall thickness of a solid, measured along rays from points distributed over its surface.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::lab {

/// Number of sample points on the surface, independent of the number of triangles.
inline constexpr std::size_t kWallPoints = 8000;

/// Returns the wall thickness behind points that are distributed evenly over the surface, and the fraction of these
/// points at which the solid overlaps itself.
///
/// Model   A ray starts at the surface point p in the direction −n, opposite to the normal. The thickness at p is the
///         distance to the point at which the ray leaves the solid.
///         * Opposite surface: the thickness counts only if the normal at the exit point is within 45° of −n. Two faces
///           that meet at an edge thus form no wall.
///         * Solids of several closed parts: the ray leaves the solid where it has left as many parts as it has
///           entered. Parts that overlap or touch thus count as one, and surfaces inside them are ignored.
/// Source  rays as in Shapira, Shamir & Cohen-Or, "Consistent mesh partitioning and skeletonisation using the shape
///         diameter function", 2008; they average over a cone, which is not exact for a plate
/// In      solid  closed, with outward normals
/// Out     first: wall thicknesses in ascending order [m], infinite at a point without an opposite surface. second:
///         fraction of points with overlap, 0 … 1
/// Cost    construction of a TriangleTree of the solid, plus about 10 µs for each point
std::pair<std::vector<double>, double> walls_of(const geometry::TriangleMesh& solid);

/// Returns the 2 % quantile of the wall thicknesses: 98 % are larger. The result is 0 if there is no wall.
double thinnest_wall_m(const std::vector<double>& walls_m);

}  // namespace tandem::lab
