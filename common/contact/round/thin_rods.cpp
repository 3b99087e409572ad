#include "common/contact/round/thin_rods.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "common/geometry/mesh_edges.hpp"

namespace tandem::contact {
namespace {

constexpr std::size_t kPlaces = 4000;
// The result is a low quantile of the radii of the inner balls at points on rods: this fraction of them is smaller.
constexpr double kThinnerShare = 0.1;
// Minimum fraction of points that are on rods. If there are fewer, they are taken for tips of spikes, and the mesh has
// no rods.
constexpr double kTipShare = 0.005;
constexpr int kShrinks = 12;
// A ball counts as inside the solid if the surface is nowhere nearer to its centre than this fraction of its radius.
constexpr double kFits = 0.98;
// A point is on a rod if the solid ends on both sides of its inner ball. This is the distance from the ball's centre at
// which that is tested, in radii of the ball.
constexpr double kBeside = 1.3;
constexpr int kTangents = 8;
// Step of a low-discrepancy sequence in the unit square: powers of the inverse of the plastic number 1.3247.
constexpr double kStepU = 0.7548776662466927, kStepV = 0.5698402909980532;

/// Returns the radius of the largest ball inside the solid that touches the surface at p; infinite if it exceeds
/// `limit_m`.
double inner_radius_m(const geometry::TriangleTree& tree, const Vec3& p, const Vec3& normal, double limit_m) {
  double radius_m = limit_m;
  for (int i = 0; i < kShrinks; ++i) {
    const auto closest = tree.closest(p - radius_m * normal, radius_m);
    if (!(closest.distance_m < kFits * radius_m)) break;
    // The ball is too large. The next, smaller ball also touches the surface at p, and it passes through the surface
    // point found, which is closest to the centre of this ball.
    const Vec3 across = p - closest.point_S;
    const double height_m = normal.dot(across);
    if (!(height_m > 0)) return std::numeric_limits<double>::infinity();
    radius_m = std::min(radius_m * kFits, across.squaredNorm() / (2 * height_m));
  }
  return radius_m < kFits * limit_m ? radius_m : std::numeric_limits<double>::infinity();
}

/// Returns whether a point is on a rod. This is so if the solid ends on both sides of the inner ball along some tangent
/// of the surface.
bool is_on_rod(const geometry::TriangleTree& tree, const Vec3& centre, const Vec3& normal, double radius_m) {
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  for (int i = 0; i < kTangents; ++i) {
    const double angle = std::numbers::pi * i / kTangents;
    const Vec3 aside = kBeside * radius_m * (std::cos(angle) * u + std::sin(angle) * v);
    if (tree.signed_distance_m(centre + aside) > 0 && tree.signed_distance_m(centre - aside) > 0) return true;
  }
  return false;
}

}  // namespace

double thin_rod_radius_m(const geometry::TriangleMesh& solid, const geometry::TriangleTree& tree, double limit_m) {
  std::vector<double> area_up_to;
  double area = 0;
  for (std::size_t t = 0; t < solid.triangles.size(); ++t) {
    area_up_to.push_back(area += geometry::doubled_area(solid, t).norm());
  }
  std::vector<double> radii_m;
  for (std::size_t i = 0; i < kPlaces && area > 0; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(kPlaces);
    const auto t = static_cast<std::size_t>(std::ranges::upper_bound(area_up_to, share * area) - area_up_to.begin());
    const auto corner = [&](std::size_t k) { return solid.vertices[static_cast<std::size_t>(solid.triangles[t][k])]; };
    double whole = 0;
    double u = std::modf(static_cast<double>(i + 1) * kStepU, &whole);
    double v = std::modf(static_cast<double>(i + 1) * kStepV, &whole);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3 p = corner(0) + u * (corner(1) - corner(0)) + v * (corner(2) - corner(0));
    const Vec3 normal = geometry::doubled_area(solid, t).normalized();
    const double radius_m = inner_radius_m(tree, p, normal, limit_m);
    if (std::isfinite(radius_m) && is_on_rod(tree, p - radius_m * normal, normal, radius_m))
      radii_m.push_back(radius_m);
  }
  if (static_cast<double>(radii_m.size()) < kTipShare * static_cast<double>(kPlaces)) {
    return std::numeric_limits<double>::infinity();
  }
  const auto thin = radii_m.begin() + static_cast<std::ptrdiff_t>(kThinnerShare * static_cast<double>(radii_m.size()));
  std::ranges::nth_element(radii_m, thin);
  return *thin;
}

}  // namespace tandem::contact
