// Compares the fast winding number with the sum of solid angles. Also checks its values for surfaces that do not
// enclose a simple solid.
#include "common/geometry/winding_number.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/random.hpp"
#include "common/geometry/tessellation.hpp"

namespace tandem::geometry {
namespace {

double exact(const TriangleMesh& mesh, const Vec3& p, int excluded_triangle = -1) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (static_cast<int>(t) == excluded_triangle) continue;
    std::array<Vec3, 3> to;
    for (std::size_t i = 0; i < 3; ++i) to[i] = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][i])] - p;
    const double a = to[0].norm(), b = to[1].norm(), c = to[2].norm();
    sum += 2 * std::atan2(to[0].dot(to[1].cross(to[2])),
                          a * b * c + to[0].dot(to[1]) * c + to[1].dot(to[2]) * a + to[2].dot(to[0]) * b);
  }
  return sum / (4 * std::numbers::pi);
}

void add(TriangleMesh& mesh, const TriangleMesh& other, const Vec3& by) {
  const auto first = static_cast<int>(mesh.vertices.size());
  for (const Vec3& vertex : other.vertices) mesh.vertices.push_back(vertex + by);
  for (const auto& triangle : other.triangles) {
    mesh.triangles.push_back({triangle[0] + first, triangle[1] + first, triangle[2] + first});
  }
}

/// Returns a torus of 2 n² triangles. The fraction `missing` of its triangles is omitted.
TriangleMesh torus(int n, double missing, Random& random) {
  TriangleMesh mesh;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * j / n;
      const double r = 0.05 + 0.02 * std::cos(v) + 0.001 * random.uniform();
      mesh.vertices.emplace_back(r * std::cos(u), r * std::sin(u), 0.02 * std::sin(v));
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int a = i * n + j, b = (i + 1) % n * n + j, c = (i + 1) % n * n + (j + 1) % n, d = i * n + (j + 1) % n;
      if (random.uniform() >= missing) mesh.triangles.push_back({a, b, c});
      if (random.uniform() >= missing) mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

TEST(WindingNumber, IsTheSumOfSolidAnglesWithinItsTolerance) {
  Random random(1, 2);
  double worst = 0;
  for (const double missing : {0.0, 0.3}) {
    const TriangleMesh mesh = torus(60, missing, random);
    const WindingNumber winding(mesh);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p = 0.1 * Vec3(random.uniform() * 2 - 1, random.uniform() * 2 - 1, random.uniform() - 0.5);
      worst = std::max(worst, std::abs(winding.at(p) - exact(mesh, p)));
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 7) {
      Vec3 middle = Vec3::Zero();
      for (const int corner : mesh.triangles[t]) middle += mesh.vertices[static_cast<std::size_t>(corner)] / 3;
      const int excluded_triangle = static_cast<int>(t);
      worst = std::max(worst, std::abs(winding.at(middle, excluded_triangle) - exact(mesh, middle, excluded_triangle)));
    }
  }
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(worst, WindingNumber::kTolerance);
  EXPECT_GT(worst, 1e-9) << "that would be the sum itself";
}

TEST(WindingNumber, IsTheSumForTrianglesOfVeryDifferentSizes) {
  Random random(3, 2);
  TriangleMesh mesh = tessellated_box(Vec3(0.2, 0.2, 0.2));
  add(mesh, torus(40, 0, random), Vec3(0.02, 0, 0));
  add(mesh, tessellated_box(Vec3(0.5, 1e-3, 1e-3)), Vec3(0, 0.05, 0));
  const WindingNumber winding(mesh);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = 0.3 * Vec3(random.uniform() * 2 - 1, random.uniform() * 2 - 1, random.uniform() * 2 - 1);
    EXPECT_NEAR(winding.at(p), exact(mesh, p), WindingNumber::kTolerance);
  }
}

/// Each strip is as long as the tube and therefore near many query points. The approximation for distant triangles must
/// not be used for it.
TEST(WindingNumber, IsTheSumForATubeOfLongStrips) {
  constexpr int kStrips = 400;
  TriangleMesh mesh;
  for (int i = 0; i < kStrips; ++i) {
    const double u = 2 * std::numbers::pi * i / kStrips;
    for (const double z : {-0.1, 0.1}) mesh.vertices.emplace_back(0.02 * std::cos(u), 0.02 * std::sin(u), z);
    const int a = 2 * i, b = 2 * ((i + 1) % kStrips);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
  const WindingNumber winding(mesh);
  Random random(4, 2);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = 0.06 * Vec3(random.uniform() - 0.5, random.uniform() - 0.5, 4 * random.uniform() - 2);
    EXPECT_NEAR(winding.at(p), exact(mesh, p), WindingNumber::kTolerance) << p.transpose();
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 50) {
    Vec3 middle = Vec3::Zero();
    for (const int corner : mesh.triangles[t]) middle += mesh.vertices[static_cast<std::size_t>(corner)] / 3;
    EXPECT_NEAR(winding.at(middle, static_cast<int>(t)), exact(mesh, middle, static_cast<int>(t)),
                WindingNumber::kTolerance);
  }
}

// The coordinates of neighbouring vertices are adjacent floating-point numbers, so the midpoint of a side equals one of
// its ends. Fails by not ending if such triangles are divided without a limit.
TEST(WindingNumber, OfTrianglesWithoutPlaceBetweenTheirCornersEnds) {
  constexpr int kSide = 30;
  constexpr double kFar_m = 1e9, kLeast_m = 1.1920928955078125e-07;  // distance between adjacent double-precision
                                                                     // numbers at 1e9
  TriangleMesh mesh;
  for (int i = 0; i < kSide; ++i) {
    for (int k = 0; k < kSide; ++k) mesh.vertices.emplace_back(kFar_m + i * kLeast_m, kFar_m + k * kLeast_m, 0);
  }
  for (int i = 0; i + 1 < kSide; ++i) {
    for (int k = 0; k + 1 < kSide; ++k) {
      const int a = i * kSide + k;
      mesh.triangles.push_back({a, a + kSide, a + kSide + 1});
      mesh.triangles.push_back({a, a + kSide + 1, a + 1});
    }
  }
  mesh.vertices.emplace_back(kFar_m + 1, kFar_m, 0);
  mesh.triangles.push_back({0, kSide, kSide * kSide});
  EXPECT_TRUE(std::isfinite(WindingNumber(mesh).at(Vec3(kFar_m, kFar_m, 1))));
}

// Queries the middle of a triangle, which itself does not count. All other triangles of a closed surface cover half of
// the full solid angle, so the result must be ½ except for rounding.
TEST(WindingNumber, IsAHalfInTheMiddleOfATriangleThatDoesNotCount) {
  for (const double size_m : {0.02, 0.03, 0.04, 0.1}) {
    const TriangleMesh mesh = tessellated_box(Vec3(size_m, 0.02, 0.02));
    const WindingNumber winding(mesh);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      Vec3 middle = Vec3::Zero();
      for (const int corner : mesh.triangles[t]) middle += mesh.vertices[static_cast<std::size_t>(corner)] / 3;
      EXPECT_NEAR(winding.at(middle, static_cast<int>(t)), 0.5, 1e-9) << size_m << ", " << t;
    }
  }
}

TEST(WindingNumber, IsTwoWhereSolidsOverlapAndZeroOutside) {
  TriangleMesh mesh = tessellated_sphere(0.03);
  add(mesh, tessellated_sphere(0.03), Vec3(0.02, 0, 0));
  const WindingNumber winding(mesh);
  EXPECT_NEAR(winding.at(Vec3(0.01, 0, 0)), 2, 0.05);
  EXPECT_NEAR(winding.at(Vec3(-0.02, 0, 0)), 1, 0.05);
  EXPECT_NEAR(winding.at(Vec3(0.04, 0, 0)), 1, 0.05);
  EXPECT_NEAR(winding.at(Vec3(0.07, 0, 0)), 0, 0.05);
}

}  // namespace
}  // namespace tandem::geometry
