// Radius of the thin rods of a mesh. Needles, wires and sutures need finer points and cells than walls.
#pragma once

#include "common/geometry/triangle_mesh.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::contact {

/// Returns the radius of the rods of a solid; infinite if no rod is thinner than `limit_m`.
///
/// Model   1. For each of many points, spread evenly over the surface, the largest ball inside the solid that touches
///            the surface there is computed.
///         2. A point is on a rod if the solid ends on both sides of its ball along some tangent of the surface.
///         3. The result is the radius that nine tenths of the balls of points on rods exceed. If fewer than one point
///            in 200 is on a rod, these points are regarded as tips of spikes, and the result is infinite
/// Source  the ball: Ma, Bae & Choi, "3D medial axis point approximation using nearest neighbors and the normal field",
///         The Visual Computer 28, 2012; the test for rods is ours
/// Cost    4,000 points, each with at most 12 queries of the tree for the ball and 16 for the test of a rod
double thin_rod_radius_m(const geometry::TriangleMesh& solid, const geometry::TriangleTree& tree, double limit_m);

}  // namespace tandem::contact
