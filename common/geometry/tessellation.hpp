// Triangles of the shapes that have a formula: where their surface points are spread before they are put on the exact
// surface.
#pragma once

#include <span>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::geometry {

TriangleMesh tessellated_box(const Vec3& size_m);

/// A corner of a profile: its distance from the axis and its height.
struct ProfilePoint {
  double radius_m = 0;
  double z_m = 0;
};

/// The profile, from the lowest point of the axis to the highest, turned about z. Corners follow the circle to 0.05 %
/// of its radius.
TriangleMesh revolved(std::span<const ProfilePoint> profile);

TriangleMesh tessellated_sphere(double radius_m);
TriangleMesh tessellated_cylinder(double radius_m, double length_m);
TriangleMesh tessellated_capsule(double radius_m, double length_m);

}  // namespace tandem::geometry
