// Meshes whose size, triangle count and clearance are known exactly: the thesis's peg and box, bodies for tests, and
// one mesh at many resolutions.
#pragma once

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::lab {

/// The peg of the peg-in-hole benchmark: 180 triangles. A prism of 30 sides, axis z, centred; the tip, chamfered, is at
/// −z.
geometry::TriangleMesh make_peg();
inline constexpr double kPegRadius_m = 0.010;  ///< radius of the circle through its corners
inline constexpr double kPegLength_m = 0.060;
inline constexpr double kPegChamfer_m = 0.002;

/// The box of the peg-in-hole benchmark: 176 triangles. Centred, with a through hole of 40 sides along z.
///
/// The clearance is the distance between the circle around the peg and the circle inscribed in the hole. So the peg
/// fits at every angle about its axis.
geometry::TriangleMesh make_box_with_hole(double clearance_m = 5e-4);
inline constexpr double kBoxWidth_m = 0.080;
inline constexpr double kBoxHeight_m = 0.040;  ///< along the hole

/// 20 · 4^levels triangles; corners on the sphere.
geometry::TriangleMesh make_sphere(double radius_m, int levels);
/// 12 triangles, centred.
geometry::TriangleMesh make_cube(double edge_m);

/// Divides each edge into `pieces` and each triangle into pieces². New corners are displaced along the normal of the
/// old surface by up to `height_m`. The displacement is a smooth function of position, so the finer mesh has no flat
/// patches.
geometry::TriangleMesh subdivided(const geometry::TriangleMesh& mesh, int pieces, double height_m);

/// Bounding box of the corners of the triangles.
/// In      mesh  at least one triangle
Eigen::AlignedBox3d bounds_of(const geometry::TriangleMesh& mesh);

}  // namespace tandem::lab
