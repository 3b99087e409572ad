#include <gmock/gmock.h>

#include <memory>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/common/haptics/proxy/proxy_scenes.hpp"

namespace tandem::haptics {
namespace {

constexpr double kTick_s = 1e-3;
constexpr double kRadius_m = 1e-3;

/// Returns walls normal to x: a plate of 2 mm as a primitive, the same plate as a mesh, and a sheet.
std::vector<ProxyObstacle> walls() {
  const geometry::TriangleMesh sheet = height_mesh(0.2, 10, [](double, double) { return 0.0; });
  geometry::TriangleMesh upright = sheet;
  for (Vec3& vertex : upright.vertices) vertex = Vec3(vertex.z(), vertex.x(), vertex.y());
  return {touchable(contact::box_field(Vec3(0.002, 0.2, 0.2))), touchable(contact::box_mesh({0.002, 0.2, 0.2})),
          touchable(upright)};
}

double half_thickness_of(const ProxyObstacle& wall) {
  return wall.mesh && wall.mesh->triangle_count() > 12 ? 0 : 0.001;
}

TEST(GodObjectMoving, AWallPushesTheProxyAheadAtAnySpeed) {
  for (const ProxyObstacle& wall : walls()) {
    for (const double speed_m_per_s : {0.01, 1.0, 10.0, 100.0}) {
      ProxyObstacle behind = wall;
      behind.X_WB.p.x() = -0.05;
      GodObject proxy = proxy_at({0, 0, 0}, {behind});
      Pose X_WB = behind.X_WB;
      for (int i = 0; i < 200; ++i) {
        X_WB.p.x() += speed_m_per_s * kTick_s;
        const RigidState motion{X_WB, {Vec3(speed_m_per_s, 0, 0), Vec3::Zero()}};
        const ProxyState& state = proxy.update(Vec3::Zero(), {&motion, 1});
        const double surface = X_WB.p.x() + half_thickness_of(wall);
        ASSERT_NEAR(state.p_W.x(), std::max(0.0, surface + kRadius_m), 2e-6) << speed_m_per_s << " m/s, tick " << i;
        if (state.is_touching) {
          EXPECT_NEAR(state.surface_velocity_W.x(), speed_m_per_s, 1e-12);
        }
      }
    }
  }
}

TEST(GodObjectMoving, AnAbsentWallHoldsNothingBackAndIsFeltAgainFromWhereTheProxyIsThen) {
  for (const ProxyObstacle& wall : walls()) {
    GodObject proxy = proxy_at({0.02, 0, 0}, {wall, touchable(contact::sphere_field(0.001), at({0, 0.05, 0}))});
    drag(proxy, {-0.02, 0, 0}, 100);
    EXPECT_NEAR(proxy.state().p_W.x(), half_thickness_of(wall) + kRadius_m, 1e-6);
    proxy.set_present(0, false);
    // The wall moves while it is excluded. Its motion must not move the proxy.
    const std::array motions{RigidState{at({0.001, 0, 0}), {}}, RigidState{at({0, 0.05, 0}), {}}};
    EXPECT_EQ(proxy.update({-0.02, 0, 0}, motions).p_W, Vec3(-0.02, 0, 0));
    EXPECT_FALSE(proxy.state().is_touching);
    proxy.set_present(0, true);
    for (int i = 1; i <= 100; ++i) proxy.update({-0.02 + 4e-4 * i, 0, 0}, motions);
    EXPECT_NEAR(proxy.state().p_W.x(), 0.001 - half_thickness_of(wall) - kRadius_m, 1e-6)
        << "the proxy must be stopped at the opposite side";
  }
}

TEST(GodObjectMoving, ARotatingBoxCarriesAStickingProxyRound) {
  const double rate_rad_per_s = 3;
  ProxyObstacle box = with_friction(touchable(contact::subdivided(contact::box_mesh({0.1, 0.1, 0.02}), 3)), 0.8, 0.8);
  GodObject proxy = proxy_at({0.03, 0, 0.02}, {box});
  drag(proxy, {0.03, 0, 0.007}, 20);
  Pose X_WB;
  const Vec3 place_B(0.03, 0, 0.011);
  // The hand follows 4 mm below the surface, so the pull is along the normal, and the proxy must rotate with the box.
  for (int i = 1; i <= 500; ++i) {
    X_WB.q = quaternion_of({0, 0, rate_rad_per_s * kTick_s * i});
    const RigidState motion{X_WB, {Vec3::Zero(), Vec3(0, 0, rate_rad_per_s)}};
    const Vec3 goal = X_WB * Vec3(0.03, 0, 0.007);
    const ProxyState& state = proxy.update(goal, {&motion, 1});
    EXPECT_LT((state.p_W - X_WB * place_B).norm(), 1e-7) << i;
    EXPECT_TRUE(state.is_sticking);
    EXPECT_LT((state.surface_velocity_W - Vec3(0, 0, rate_rad_per_s).cross(state.p_W)).norm(), 1e-9);
  }
}

TEST(GodObjectMoving, ASlippingBoxLeavesTheProxyBehind) {
  ProxyObstacle box = touchable(contact::subdivided(contact::box_mesh({0.1, 0.1, 0.02}), 3));
  GodObject proxy = proxy_at({0.03, 0, 0.02}, {box});
  drag(proxy, {0.03, 0, 0.007}, 20);
  for (int i = 1; i <= 100; ++i) {
    const RigidState motion{at(Vec3(1e-4 * i, 0, 0)), {Vec3(0.1, 0, 0), Vec3::Zero()}};
    EXPECT_LT((proxy.update({0.03, 0, 0.007}, {&motion, 1}).p_W - Vec3(0.03, 0, 0.011)).norm(), 1e-7) << i;
  }
}

TEST(GodObjectMoving, ALiftCarriesTheProxyUpAgainstACornerOfTwoBodies) {
  // The floor rises; the wall at x = 0.02 m is fixed. The hand pulls the proxy into the corner between them.
  ProxyObstacle floor = touchable(contact::box_field(Vec3(0.1, 0.1, 0.02)), at({0, 0, -0.02}));
  ProxyObstacle wall = touchable(contact::box_mesh({0.02, 0.1, 0.1}, {0.03, 0, 0}));
  GodObject proxy = proxy_at({0, 0, 0.01}, {floor, wall});
  drag(proxy, {0.03, 0, -0.02}, 50);
  for (int i = 0; i < 40; ++i) {
    const double top = -0.01 + 5e-4 * i;
    const std::array motions{RigidState{at(Vec3(0, 0, top - 0.01)), {Vec3(0, 0, 0.5), Vec3::Zero()}}, RigidState{}};
    const ProxyState& state = proxy.update({0.03, 0, -0.02}, motions);
    EXPECT_LT((state.p_W - Vec3(0.02 - kRadius_m, 0, top + kRadius_m)).norm(), 1e-7) << i;
    EXPECT_EQ(state.contact_count, 2U);
  }
}

TEST(GodObjectMoving, AWedgeSqueezesTheProxyOut) {
  // A ceiling that is tilted by 45° descends on a floor. The proxy must slide out sideways for any pull of the hand.
  const Quat slope = quaternion_of({0, 3 * std::numbers::pi / 4, 0});
  const Vec3 n = slope * Vec3::UnitZ();
  ProxyObstacle floor = touchable(contact::half_space_field());
  ProxyObstacle ceiling = touchable(contact::half_space_field(), {-0.02 * n, slope});
  GodObject proxy = proxy_at({0, 0, kRadius_m}, {floor, ceiling});
  for (int i = 0; i < 60; ++i) {
    const Pose X_ceiling{-0.02 * n - Vec3(0, 0, 1e-3 * i), slope};
    const std::array motions{RigidState{}, RigidState{X_ceiling, {Vec3(0, 0, -1), Vec3::Zero()}}};
    const ProxyState& state = proxy.update({0, 0, -0.001}, motions);
    EXPECT_GE(state.p_W.z(), kRadius_m - GodObject::kTolerance_m) << i;
    EXPECT_GE(n.dot(state.p_W - X_ceiling.p), kRadius_m - GodObject::kTolerance_m) << i;
  }
  EXPECT_GT(std::abs(proxy.state().p_W.x()), 0.01);
}

TEST(GodObjectMoving, AViceThatClosesAndOpensLetsTheProxyStayBetween) {
  // When the gap between the jaws is smaller than the ball's diameter, no valid position exists. When the vice opens
  // again, the proxy must still be between the jaws.
  ProxyObstacle left = walls()[1], right = walls()[1];
  left.X_WB.p.x() = -0.02;
  right.X_WB.p.x() = 0.02;
  GodObject proxy = proxy_at(Vec3::Zero(), {left, right});
  bool was_held_back = false;
  for (int i = 0; i <= 400; ++i) {
    const double gap = 0.019 * std::abs(std::cos(std::numbers::pi * i / 400)) + 0.0012;
    const std::array motions{RigidState{at(Vec3(-gap, 0, 0)), {}}, RigidState{at(Vec3(gap, 0, 0)), {}}};
    const ProxyState& state = proxy.update({0.05, 0, 0}, motions);
    ASSERT_TRUE(is_finite(state.p_W));
    was_held_back = was_held_back || (state.faults & kProxyHeldBack) != 0;
  }
  EXPECT_TRUE(was_held_back);
  EXPECT_NEAR(proxy.state().p_W.x(), 0.019 + 0.0012 - 0.001 - kRadius_m, 2e-6);
  EXPECT_EQ(proxy.state().faults, 0);
}

TEST(GodObjectMoving, ATumblingMeshNeverPassesTheProxy) {
  constexpr std::uint64_t kSeed = 21;
  Random random(kSeed);
  const geometry::TriangleMesh mesh = contact::sphere_mesh(0.02, 3);
  const geometry::TriangleTree tree(mesh);
  GodObject proxy = proxy_at({0, 0, 0.04}, {with_friction(touchable(mesh), 0.5, 0.3)}, true);
  Pose X_WB;
  Twist V_WB;
  for (int i = 0; i < 5000; ++i) {
    // The mesh moves around the goal at up to 2 m/s and 30 rad/s.
    if (i % 50 == 0) {
      V_WB.w = 10 * Vec3(random.normal(), random.normal(), random.normal());
      V_WB.v = clamped_to_length(Vec3(random.normal(), random.normal(), random.normal()) - 20 * X_WB.p, 2.0);
    }
    X_WB = integrate(X_WB, V_WB, kTick_s);
    const RigidState motion{X_WB, V_WB};
    const ProxyState& state = proxy.update({0.01, 0, 0.02}, {&motion, 1});
    ASSERT_GT(tree.signed_distance_m(X_WB.inverse() * state.p_W), kRadius_m - GodObject::kTolerance_m)
        << "seed " << kSeed << ", tick " << i;
  }
}

}  // namespace
}  // namespace tandem::haptics
