// Triangle meshes of analytic shapes. Sample points are distributed over them and then projected onto the exact
// surface.
#pragma once

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

TriangleMesh tessellated_box(const Vec3& size_m);

TriangleMesh tessellated_sphere(double radius_m);
TriangleMesh tessellated_cylinder(double radius_m, double length_m);
TriangleMesh tessellated_capsule(double radius_m, double length_m);

}  // namespace tandem::geometry
