// How thick the walls of a solid are: straight through, at points spread over its surface.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::lab {

/// So many points of the surface are looked at, however many triangles it has.
inline constexpr std::size_t kWallPoints = 8000;

/// The walls behind points spread evenly over the area, and the share of these points where the solid overlaps itself.
///
/// Model   from p against the normal n to where the ray leaves the solid, if the surface there faces the other way: its
///         normal is within 45° of −n. Faces that meet at an edge bound no wall. As many surfaces are left as were entered,
///         so parts that overlap or stand on each other are one, and what is inside of them is no surface
/// Source  rays as in Shapira, Shamir & Cohen-Or, "Consistent mesh partitioning and skeletonisation using the shape
///         diameter function", 2008; theirs are a cone's mean, which is not exact for a plate
/// In      solid  closed, normals out
/// Out     walls [m], the thinnest first, infinite where nothing is opposite; share, 0 … 1
/// Cost    as a TriangleTree of it, and some 10 µs a point
std::pair<std::vector<double>, double> walls_of(const geometry::TriangleMesh& solid);

/// Than which all but 2 % of these walls are thicker; 0: no wall.
double thinnest_wall_m(const std::vector<double>& walls_m);

}  // namespace tandem::lab
