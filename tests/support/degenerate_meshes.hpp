// Meshes without a surface, or with a size near the limits of floating-point numbers.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "common/base/random.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace tandem::test {

/// A random mesh of 0 to 3 dimensions: a point, a line, a plane or a cloud. Its unit is between 1e-308 and 1e308, and
/// it may be far from the origin. Coordinates may be infinite or NaN.
inline geometry::TriangleMesh degenerate_mesh(Random& random) {
  const auto below = [&random](std::size_t count) { return static_cast<std::size_t>(random.next_u32() % count); };
  const auto direction = [&random] { return Vec3(random.normal(), random.normal(), random.normal()); };
  const std::size_t dimensions = below(4);
  const bool is_usual = random.uniform() < 0.4;
  const double unit = is_usual ? 1 : std::pow(10, random.uniform(-308, 308));
  const Vec3 place = (random.uniform() < 0.5 ? 0.0 : std::pow(10, random.uniform(-3, 6))) * unit * direction();
  const std::array<Vec3, 3> axes{direction(), direction(), direction()};
  geometry::TriangleMesh mesh;
  const std::size_t vertices = 3 + below(10);
  for (std::size_t i = 0; i < vertices; ++i) {
    Vec3 p = place;
    for (std::size_t axis = 0; axis < dimensions; ++axis) p += random.uniform(-1, 1) * unit * axes[axis];
    mesh.vertices.push_back(p);
  }
  if (random.uniform() < 0.1) {
    constexpr std::array kNone{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                               -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::max()};
    mesh.vertices[below(vertices)][static_cast<Eigen::Index>(below(3))] = kNone[below(kNone.size())];
  }
  const std::size_t triangles = 1 + below(12);
  for (std::size_t i = 0; i < triangles; ++i) {
    mesh.triangles.push_back(
        {static_cast<int>(below(vertices)), static_cast<int>(below(vertices)), static_cast<int>(below(vertices))});
  }
  return mesh;
}

}  // namespace tandem::test
