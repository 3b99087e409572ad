#include "common/geometry/tessellation.hpp"

#include <numbers>
#include <span>
#include <vector>

namespace tandem::geometry {
namespace {

// Number of segments of a full circle of radius R. The chords are inside the circle by at most R (1 − cos(π/96)), which
// is 0.05 % of R.
constexpr int kSegments = 96;

/// Corner of a profile, given by its distance from the axis and its height.
struct ProfilePoint {
  double radius_m = 0;
  double z_m = 0;
};

/// Appends an arc with centre (0, z_m) to the profile, including both ends. Angles are measured from the downward
/// direction.
void append_arc(std::vector<ProfilePoint>& profile, double radius_m, double z_m, double from_rad, double to_rad,
                int steps) {
  for (int i = 0; i <= steps; ++i) {
    const double angle = from_rad + (to_rad - from_rad) * i / steps;
    profile.push_back({std::max(0.0, radius_m * std::sin(angle)), z_m - radius_m * std::cos(angle)});
  }
}

/// Returns the surface of a profile that is revolved about z. The profile goes from the lowest point on the axis to the
/// highest. The mesh differs from the exact surface by at most 0.05 % of its radius.
TriangleMesh revolved(std::span<const ProfilePoint> profile) {
  TriangleMesh mesh;
  const auto add_vertex = [&mesh](const ProfilePoint& point, int segment) {
    const double angle = 2 * std::numbers::pi * segment / kSegments;
    mesh.vertices.emplace_back(point.radius_m * std::cos(angle), point.radius_m * std::sin(angle), point.z_m);
  };
  const auto rings = static_cast<int>(profile.size()) - 2;
  add_vertex(profile.front(), 0);
  for (const ProfilePoint& point : profile.subspan(1, static_cast<std::size_t>(rings))) {
    for (int segment = 0; segment < kSegments; ++segment) add_vertex(point, segment);
  }
  add_vertex(profile.back(), 0);

  const auto ring_vertex = [](int ring, int segment) { return 1 + ring * kSegments + segment % kSegments; };
  const auto top = static_cast<int>(mesh.vertices.size()) - 1;
  for (int segment = 0; segment < kSegments; ++segment) {
    mesh.triangles.push_back({0, ring_vertex(0, segment + 1), ring_vertex(0, segment)});
    for (int ring = 0; ring + 1 < rings; ++ring) {
      const int a = ring_vertex(ring, segment);
      const int b = ring_vertex(ring, segment + 1);
      const int c = ring_vertex(ring + 1, segment + 1);
      const int d = ring_vertex(ring + 1, segment);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
    mesh.triangles.push_back({top, ring_vertex(rings - 1, segment), ring_vertex(rings - 1, segment + 1)});
  }
  return mesh;
}

}  // namespace

TriangleMesh tessellated_box(const Vec3& size_m) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 sign((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.5 : -0.5, (corner & 4) != 0 ? 0.5 : -0.5);
    mesh.vertices.push_back(sign.cwiseProduct(size_m));
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

TriangleMesh tessellated_sphere(double radius_m) {
  std::vector<ProfilePoint> profile;
  append_arc(profile, radius_m, 0, 0, std::numbers::pi, kSegments / 2);
  return revolved(profile);
}

TriangleMesh tessellated_cylinder(double radius_m, double length_m) {
  const double half = length_m / 2;
  const std::vector<ProfilePoint> profile = {{0, -half}, {radius_m, -half}, {radius_m, half}, {0, half}};
  return revolved(profile);
}

TriangleMesh tessellated_capsule(double radius_m, double length_m) {
  std::vector<ProfilePoint> profile;
  append_arc(profile, radius_m, -length_m / 2, 0, std::numbers::pi / 2, kSegments / 4);
  append_arc(profile, radius_m, length_m / 2, std::numbers::pi / 2, std::numbers::pi, kSegments / 4);
  return revolved(profile);
}

}  // namespace tandem::geometry
