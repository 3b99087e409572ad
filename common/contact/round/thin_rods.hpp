// Radius of the thin rods of a mesh: needles, wires and sutures need finer points and cells than walls.
#pragma once

#include "common/geometry/triangle_mesh.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::contact {

/// Radius of the rods of a solid; infinite: no rod is thinner than `limit_m`.
///
/// Model   At places spread evenly over the surface, the largest inner ball that touches the surface there. The place
///         is on a rod where the solid is no wider than the ball's neighbourhood along some tangent, on both sides of
///         it. The result is smaller than nine tenths of the radii of such places. If fewer than one place in 200 is on
///         a rod, these places are regarded as tips.
/// Source  the ball: Ma, Bae & Choi, "3D medial axis point approximation using nearest neighbors and the normal field",
///         The Visual Computer 28, 2012; the test for rods is ours
/// Cost    some 4,000 places, each ten queries of the tree at most
double thin_rod_radius_m(const geometry::TriangleMesh& solid, const geometry::TriangleTree& tree, double limit_m);

}  // namespace tandem::contact
