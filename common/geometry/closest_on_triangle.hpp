// Closest point on one triangle. Sampling a mesh calls this function millions of times; contact with a point calls it a
// few times per tick.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem::geometry {

struct OnTriangle {
  Vec3 from_a;  ///< closest point − corner a
  int feature;  ///< part that contains this point: 0: face; 1..3: edges ab, bc, ca; 4..6: corners a, b, c
};

/// Returns the point of the triangle with corners a, a + ab and a + ac that is closest to the point a + ap, and the
/// feature (face, edge or corner) that contains it. A triangle without area is treated as its three edges.
///
/// Source  Ericson, "Real-Time Collision Detection", 2005, §5.1.5 (Voronoi regions)
inline OnTriangle closest_on_triangle(const Vec3& ab, const Vec3& ac, const Vec3& ap) noexcept {
  const auto ratio = [](double a, double b) { return b > 0 ? a / b : 0.0; };
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {Vec3::Zero(), 4};
  const double ab_ab = ab.squaredNorm();
  const double ab_ac = ab.dot(ac);
  const double d3 = d1 - ab_ab;
  const double d4 = d2 - ab_ac;
  if (d3 >= 0 && d4 <= d3) return {ab, 5};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {ratio(d1, d1 - d3) * ab, 1};
  const double d5 = d1 - ab_ac;
  const double d6 = d2 - ac.squaredNorm();
  if (d6 >= 0 && d5 <= d6) return {ac, 6};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {ratio(d2, d2 - d6) * ac, 3};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return {ab + ratio(d4 - d3, (d4 - d3) + (d5 - d6)) * (ac - ab), 2};
  const double scale = ratio(1.0, va + vb + vc);
  return {ab * (vb * scale) + ac * (vc * scale), 0};
}

}  // namespace tandem::geometry
