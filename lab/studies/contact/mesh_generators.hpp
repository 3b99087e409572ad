// Generates meshes whose size, triangle count and clearance are known exactly: the peg and the box of the source thesis
// (Hou 2014), bodies for tests, and one mesh at many resolutions.
#pragma once

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::lab {

/// Returns the peg of the peg-in-hole benchmark: 180 triangles. It is a centred prism with 30 sides and axis z; its
/// chamfered tip is at −z.
geometry::TriangleMesh make_peg();
inline constexpr double kPegRadius_m = 0.010;  ///< radius of the circle through the corners of the cross section
inline constexpr double kPegLength_m = 0.060;
inline constexpr double kPegChamfer_m = 0.002;

/// Returns the box of the peg-in-hole benchmark: 176 triangles. It is centred and has a through hole with 40 sides
/// along z.
///
/// The clearance is the distance between the circumscribed circle of the peg and the inscribed circle of the hole.
/// Therefore the peg fits at every angle about its axis.
geometry::TriangleMesh make_box_with_hole(double clearance_m = 5e-4);
inline constexpr double kBoxWidth_m = 0.080;
inline constexpr double kBoxHeight_m = 0.040;  ///< height along the axis of the hole

/// Returns a sphere of 20 · 4^levels triangles. All vertices lie on the sphere.
geometry::TriangleMesh make_sphere(double radius_m, int levels);
/// Returns a centred cube of 12 triangles.
geometry::TriangleMesh make_cube(double edge_m);

/// Returns a finer mesh: each edge is divided into `pieces` parts, and each triangle into pieces² triangles. New
/// vertices are displaced along the normal of the original surface by up to `height_m`. Without the displacement, the
/// finer mesh would have flat patches. The displacement is a smooth function of position.
geometry::TriangleMesh subdivided(const geometry::TriangleMesh& mesh, int pieces, double height_m);

/// Returns the bounding box of the vertices that belong to triangles; unused vertices are ignored.
/// In      mesh  has at least one triangle
Eigen::AlignedBox3d bounds_of(const geometry::TriangleMesh& mesh);

}  // namespace tandem::lab
