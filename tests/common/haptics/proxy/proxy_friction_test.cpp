#include <gmock/gmock.h>

#include <memory>

#include "tests/common/haptics/proxy/proxy_scenes.hpp"

namespace tandem::haptics {
namespace {

constexpr double kStill = 0.6;
constexpr double kSliding = 0.4;
constexpr double kDepth_m = 3e-3;  ///< depth of the goal below a ball that rests on the plane

std::vector<ProxyObstacle> rough_planes() {
  return {with_friction(touchable(contact::half_space_field()), kStill, kSliding),
          with_friction(touchable(height_mesh(0.2, 20, [](double, double) { return 0.0; })), kStill, kSliding)};
}

Vec3 pressed(double x) {
  return {x, 0, 1e-3 - kDepth_m};
}

/// Returns a proxy at rest at x = 0, where the hand presses straight down.
GodObject at_rest_on(const ProxyObstacle& plane) {
  GodObject proxy = proxy_at({0, 0, 0.01}, {plane});
  drag(proxy, pressed(0), 20);
  return proxy;
}

TEST(ProxyFriction, SticksInsideTheConeOfStaticFriction) {
  for (const ProxyObstacle& plane : rough_planes()) {
    GodObject proxy = at_rest_on(plane);
    drag(proxy, pressed(0.99 * kStill * kDepth_m), 50);
    EXPECT_LT((proxy.state().p_W - Vec3(0, 0, 1e-3)).norm(), 1e-9);
    EXPECT_TRUE(proxy.state().is_sticking);
  }
}

TEST(ProxyFriction, SlidesAtTheEdgeOfTheConeOfDynamicFriction) {
  for (const ProxyObstacle& plane : rough_planes()) {
    GodObject proxy = at_rest_on(plane);
    drag(proxy, pressed(1.01 * kStill * kDepth_m), 50);
    for (int i = 1; i <= 50; ++i) {
      const double x = 1.01 * kStill * kDepth_m + 2e-4 * i;
      const ProxyState& state = proxy.update(pressed(x));
      EXPECT_NEAR(state.p_W.x(), x - kSliding * kDepth_m, 1e-9) << i;
      EXPECT_FALSE(state.is_sticking);
      const Vec3 pull = state.p_W - state.goal_W;
      EXPECT_NEAR(pull.head<2>().norm() / pull.z(), kSliding, 1e-9);
    }
  }
}

TEST(ProxyFriction, SticksAgainWhenTheHandTurnsBack) {
  for (const ProxyObstacle& plane : rough_planes()) {
    GodObject proxy = at_rest_on(plane);
    drag(proxy, pressed(0.01), 100);
    const double rest = 0.01 - kSliding * kDepth_m;
    drag(proxy, pressed(rest - 0.9 * kStill * kDepth_m), 100);
    EXPECT_NEAR(proxy.state().p_W.x(), rest, 1e-8);
    EXPECT_TRUE(proxy.state().is_sticking);
    drag(proxy, pressed(rest - 1.1 * kStill * kDepth_m), 20);
    EXPECT_FALSE(proxy.state().is_sticking);
  }
}

TEST(ProxyFriction, HoldsOnASlopeWhoseAngleIsInTheCone) {
  for (const double slope : {0.5, 0.7}) {
    ProxyObstacle plane = rough_planes()[0];
    plane.X_WB.q = quaternion_of({0, slope, 0});
    const Vec3 n = plane.X_WB.q * Vec3::UnitZ();
    GodObject proxy = proxy_at(0.01 * n, {plane});
    drag(proxy, 1e-3 * n - Vec3(0, 0, 1e-6), 10);
    const Vec3 place = proxy.state().p_W;
    // The pull is vertical, like a weight, so its angle to the normal is the slope.
    drag(proxy, 1e-3 * n - Vec3(0, 0, 5e-3), 50);
    EXPECT_EQ((proxy.state().p_W - place).norm() < 1e-5, std::tan(slope) < kStill) << slope;
  }
}

TEST(ProxyFriction, EndsWhenTheHandLifts) {
  GodObject proxy = at_rest_on(rough_planes()[0]);
  drag(proxy, pressed(0.001), 20);
  drag(proxy, {0.003, 0, 0.004}, 5);
  EXPECT_LT((proxy.state().p_W - Vec3(0.003, 0, 0.004)).norm(), 1e-12);
  EXPECT_FALSE(proxy.state().is_touching);
}

TEST(ProxyFriction, PullStaysInTheConeOnARoughSphere) {
  GodObject proxy = proxy_at({0, 0, 0.05}, {with_friction(touchable(contact::sphere_field(0.03)), kStill, kSliding)});
  drag(proxy, {0, 0, 0.028}, 20);
  for (int i = 0; i < 500; ++i) {
    const double angle = 2e-3 * i;
    const ProxyState& state = proxy.update(0.028 * Vec3(std::sin(angle), 0, std::cos(angle)));
    const Vec3 n = state.p_W.normalized();
    const Vec3 pull = state.p_W - state.goal_W;
    const double cone = state.is_sticking ? kStill : kSliding;
    // Tolerance of the friction cone: the position error of about 1 µm, divided by the pull of 3 mm, is below 1e-3.
    EXPECT_LT((pull - pull.dot(n) * n).norm() / pull.dot(n), cone + 1e-3) << i;
    EXPECT_NEAR(state.p_W.norm(), 0.031, 2e-6);
  }
}

}  // namespace
}  // namespace tandem::haptics
