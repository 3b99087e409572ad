#include <gmock/gmock.h>

#include <numbers>

#include "tests/common/haptics/proxy/proxy_scenes.hpp"

namespace tandem::haptics {
namespace {

constexpr double kProxyShadingRadius_m = 0.03;

/// Returns the largest rotation of the force between consecutive updates. The hand moves along a great circle 2 mm
/// inside a coarse sphere, by 0.05 mm per update.
double largest_turn_rad(bool is_shaded) {
  GodObject proxy = proxy_at({0, 0, 0.05}, {touchable(contact::sphere_mesh(kProxyShadingRadius_m, 3))}, is_shaded);
  const Vec3 aside(0.31, 0.95, 0);
  Vec3 last = Vec3::UnitZ();
  double largest = 0;
  const double step_rad = 5e-5 / (kProxyShadingRadius_m - 0.002);
  for (int i = 0; i * step_rad < 2; ++i) {
    const double angle = i * step_rad;
    const ProxyState& state = proxy.update((kProxyShadingRadius_m - 0.002) *
                                           (std::cos(angle) * Vec3::UnitZ() + std::sin(angle) * aside.normalized()));
    const Vec3 direction = (state.p_W - state.goal_W).normalized();
    if (i > 0) largest = std::max(largest, std::acos(std::min(1.0, direction.dot(last))));
    last = direction;
  }
  return largest;
}

TEST(ProxyShading, ForceTurnsSmoothlyOverTheFacetsOfACoarseSphere) {
  const double facets = largest_turn_rad(false);
  const double shaded = largest_turn_rad(true);
  // The sphere has 512 triangles, whose facets meet at angles of up to 0.2 rad.
  // - Without shading, the force jumps by most of this angle.
  // - With shading, it rotates with the hand by 0.0018 rad per step. Where the interpolated normals change quickly, it
  //   rotates up to three times as fast.
  EXPECT_GT(facets, 0.08);
  EXPECT_LT(shaded, 3 * 5e-5 / (kProxyShadingRadius_m - 0.002));
}

TEST(ProxyShading, ForceOnACoarseSpherePointsFromItsCentre) {
  GodObject proxy = proxy_at({0, 0, 0.05}, {touchable(contact::sphere_mesh(kProxyShadingRadius_m, 3))}, true);
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 direction = Vec3(std::sin(1e-3 * i), 0.5 * std::sin(7e-4 * i), std::cos(1e-3 * i)).normalized();
    const ProxyState& state = proxy.update((kProxyShadingRadius_m - 0.002) * direction);
    if (i > 0) worst = std::max(worst, ((state.p_W - state.goal_W).normalized() - direction).norm());
  }
  // The bound is half of the error that the facets would cause without shading.
  EXPECT_LT(worst, 0.04);
}

TEST(ProxyShading, KeepsTheEdgesOfACube) {
  GodObject shaded =
      proxy_at({0, 0, 0.03}, {touchable(contact::subdivided(contact::box_mesh({0.04, 0.04, 0.04}), 2))}, true);
  drag(shaded, {0.0195, 0.003, 0.018}, 100);
  const Vec3 pull = shaded.state().p_W - shaded.state().goal_W;
  EXPECT_LT(pull.head<2>().norm(), 1e-9);
}

TEST(ProxyShading, StaysAtRestForAHandAtRestInABowlDeeperThanItsRadius) {
  const geometry::TriangleMesh bowl = height_mesh(0.04, 40, [](double x, double y) { return 100 * (x * x + y * y); });
  GodObject proxy = proxy_at({0, 0, 0.02}, {touchable(bowl)}, true);
  // The goal is 12 mm below the bottom of the bowl, farther than its radius of curvature, 5 mm. The steps of the proxy
  // therefore alternate in direction. They must become smaller than 5 µm.
  drag(proxy, {0.0015, 0.0007, -0.012}, 200);
  for (int i = 0; i < 300; ++i) proxy.update({0.0015, 0.0007, -0.012});
  const Vec3 rest = proxy.state().p_W;
  for (int i = 0; i < 100; ++i) {
    EXPECT_LT((proxy.update({0.0015, 0.0007, -0.012}).p_W - rest).norm(), 5e-6) << i;
  }
}

TEST(ProxyShading, DoesNotDependOnHowTrianglesAreTurned) {
  geometry::TriangleMesh turned = contact::sphere_mesh(kProxyShadingRadius_m, 3);
  for (std::size_t i = 0; i < turned.triangles.size(); i += 2)
    std::swap(turned.triangles[i][0], turned.triangles[i][1]);
  GodObject a = proxy_at({0, 0, 0.05}, {touchable(contact::sphere_mesh(kProxyShadingRadius_m, 3))}, true);
  GodObject b = proxy_at({0, 0, 0.05}, {touchable(turned)}, true);
  for (int i = 0; i < 300; ++i) {
    const Vec3 goal = (kProxyShadingRadius_m - 0.002) * Vec3(std::sin(3e-3 * i), 0.01, std::cos(3e-3 * i));
    EXPECT_LT((a.update(goal).p_W - b.update(goal).p_W).norm(), 1e-6) << i;
  }
}

}  // namespace
}  // namespace tandem::haptics
