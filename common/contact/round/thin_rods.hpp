// Radius of the thin rods of a mesh. Needles, wires and sutures need finer points and cells than walls.
#pragma once

#include "common/geometry/triangle_mesh.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::contact {

/// Returns the radius of the rods of a solid; infinite if no rod is thinner than `limit_m`.
///
/// Model   For points spread evenly over the surface, the largest inner ball that touches the surface there is
///         computed. A point is on a rod if, along some tangent, the solid ends at both sides of its ball. The result
///         is the radius that nine tenths of the balls of points on rods exceed. If fewer than one point in 200 is on a
///         rod, these points are regarded as tips of spikes
/// Source  the ball: Ma, Bae & Choi, "3D medial axis point approximation using nearest neighbors and the normal field",
///         The Visual Computer 28, 2012; the test for rods is ours
/// Cost    4,000 points, each with at most 12 queries of the tree for the ball and 16 for the test of a rod
double thin_rod_radius_m(const geometry::TriangleMesh& solid, const geometry::TriangleTree& tree, double limit_m);

}  // namespace tandem::contact
