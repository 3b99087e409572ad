#include "common/haptics/proxy/god_object.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "common/base/random.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "tests/common/haptics/proxy/proxy_scenes.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::haptics {
namespace {

constexpr double kGodObjectRadius_m = 1e-3;
constexpr double kGodObjectTick_s = 1e-3;
/// Tolerance of positions [m]: twice the step of about 1 µm at which an update ends.
constexpr double kSettled_m = 2e-6;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

geometry::TriangleMesh flat_mesh() {
  return height_mesh(0.2, 20, [](double, double) { return 0.0; });
}

TEST(GodObject, IsWhereTheHandIsInFreeSpace) {
  GodObject proxy = proxy_at({0, 0, 0.02}, {touchable(flat_mesh())});
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Vec3 goal(random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), random.uniform(0.0011, 0.05));
    // A motion of 10 cm close to the sheet takes several updates. Each of them except the last reports kProxyHeldBack.
    for (int more = 0; more < 40 && proxy.update(goal).faults != 0; ++more)
      EXPECT_EQ(proxy.state().faults, kProxyHeldBack);
    EXPECT_LT((proxy.state().p_W - goal).norm(), 1e-12);
    EXPECT_FALSE(proxy.state().is_touching);
    EXPECT_EQ(proxy.state().faults, 0);
  }
}

TEST(GodObject, KeepsUpWithAHandAtOneMetrePerSecondOnAMesh) {
  GodObject proxy = proxy_at(
      {-0.09, 0, 0.02}, {touchable(height_mesh(0.2, 100, [](double x, double) { return 0.001 * std::sin(100 * x); }))});
  drag(proxy, {-0.09, 0, -0.004}, 50);
  for (int i = 0; i < 180; ++i) {
    const std::uint8_t faults = proxy.update({-0.09 + 1e-3 * i, 0, -0.004}).faults;
    // The search range of the proxy adapts to the speed of the hand. It is wide enough after three updates.
    if (i >= 3) {
      EXPECT_EQ(faults, 0) << i;
    }
  }
}

TEST(GodObject, RestsOnAPlaneAtItsRadiusWithForceByDepth) {
  const auto law =
      make_coupling_law("spring-damper", {.stiffness_n_per_m = 500, .force_limit_n = 100, .saturation_softness = 0});
  for (const ProxyObstacle& plane : {touchable(contact::half_space_field()), touchable(flat_mesh())}) {
    GodObject proxy = proxy_at({0, 0, 0.01}, {plane});
    drag(proxy, {0.0234, 0.0123, -0.004}, 50);
    EXPECT_LT((proxy.state().p_W - Vec3(0.0234, 0.0123, kGodObjectRadius_m)).norm(), 1e-9);
    const Vec3 force = proxy_force_on_hand_W(proxy.state(), *law, Vec3::Zero());
    EXPECT_LT((force - Vec3(0, 0, 500 * (0.004 + kGodObjectRadius_m))).norm(), 1e-6);
    EXPECT_EQ(proxy.state().contact_count, 1U);
  }
}

TEST(GodObject, DamperActsAlongThePullAlone) {
  const auto law = make_coupling_law(
      "spring-damper",
      {.stiffness_n_per_m = 500, .damping_n_s_per_m = 2, .force_limit_n = 100, .saturation_softness = 0});
  GodObject proxy = proxy_at({0, 0, 0.01}, {touchable(contact::half_space_field())});
  drag(proxy, {0, 0, -0.004}, 10);
  const Vec3 still = proxy_force_on_hand_W(proxy.state(), *law, Vec3::Zero());
  EXPECT_LT((proxy_force_on_hand_W(proxy.state(), *law, {0.3, -0.2, 0}) - still).norm(), 1e-12);
  EXPECT_LT((proxy_force_on_hand_W(proxy.state(), *law, {0, 0, -0.1}) - still - Vec3(0, 0, 0.2)).norm(), 1e-12);
}

/// Returns the forces on a hand that moves along z with the velocity `v_z`. It starts `from_m` above the height at
/// which the ball touches the plane z = 0.
std::vector<Vec3> forces_on_way(const CouplingLaw& law, double from_m, double v_z, int ticks) {
  GodObject proxy = proxy_at({0, 0, 0.01}, {touchable(contact::half_space_field())});
  std::vector<Vec3> forces;
  for (int i = 0; i < ticks; ++i) {
    const ProxyState& state = proxy.update({0, 0, kGodObjectRadius_m + from_m + v_z * kGodObjectTick_s * i});
    forces.push_back(proxy_force_on_hand_W(state, law, {0, 0, v_z}));
  }
  return forces;
}

TEST(GodObject, NoLawDrawsAHandInThatLeaves) {
  for (const CouplingLawInfo& info : coupling_laws()) {
    const auto law = info.make({.stiffness_n_per_m = 300, .damping_n_s_per_m = 3});
    for (const double speed : {0.01, 0.1, 0.3, 1.0, 3.0}) {
      for (const Vec3& force : forces_on_way(*law, -5e-3, speed, 100)) {
        EXPECT_GE(force.z(), 0) << info.name << " at " << speed << " m/s";
        EXPECT_EQ(force.head<2>(), Eigen::Vector2d::Zero());
      }
    }
  }
}

TEST(GodObject, ForceHasNoStepWhereContactBeginsAndEnds) {
  const CouplingParameters given{.stiffness_n_per_m = 300, .damping_n_s_per_m = 3};
  for (const CouplingLawInfo& info : coupling_laws()) {
    const auto law = info.make(given);
    for (const double speed : {0.003, 0.03, 0.1, 0.3}) {
      // Bound of the force change per tick, for every curve. The spring's slope is at most the stiffness k. The force
      // of the damping b at the speed v rises to b v over the depth kFullDamping_m. The sum of both slopes bounds the
      // slope of the force.
      const double slope = given.stiffness_n_per_m + given.damping_n_s_per_m * speed / kFullDamping_m;
      const double bound = slope * speed * kGodObjectTick_s + 1e-12;
      for (const double phase : {0.0, 0.3, 0.7}) {
        const double aside_m = (5 + phase) * speed * kGodObjectTick_s;
        const int ticks = 10 + static_cast<int>(2e-3 / (speed * kGodObjectTick_s));
        for (const auto& forces :
             {forces_on_way(*law, aside_m, -speed, ticks), forces_on_way(*law, -2e-3 - aside_m, speed, 10 + ticks)}) {
          for (std::size_t i = 1; i < forces.size(); ++i) {
            EXPECT_LE((forces[i] - forces[i - 1]).norm(), bound) << info.name << " at " << speed << " m/s, tick " << i;
          }
        }
      }
    }
  }
}

TEST(GodObject, StopsInACornerOfThreeWallsAtOnce) {
  const double inner = 0.02 - kGodObjectRadius_m;
  std::vector<ProxyObstacle> walls;
  for (int axis = 0; axis < 3; ++axis) {
    const Quat turn = Quat::FromTwoVectors(Vec3::UnitZ(), -Vec3::Unit(axis));
    walls.push_back(touchable(contact::half_space_field(), {0.02 * Vec3::Unit(axis), turn}));
  }
  // The corner is tested twice: as three half-spaces, and as the inside of a mesh.
  for (const std::vector<ProxyObstacle>& corner :
       {walls, {touchable(contact::subdivided(contact::box_mesh({0.04, 0.04, 0.04}), 3))}}) {
    GodObject proxy = proxy_at(Vec3::Zero(), corner);
    drag(proxy, {0.025, 0.027, 0.023}, 40);
    EXPECT_LT((proxy.state().p_W - Vec3::Constant(inner)).norm(), 1e-9);
    EXPECT_EQ(proxy.state().contact_count, 3U);
    const Vec3 rest = proxy.state().p_W;
    for (int i = 0; i < 100; ++i) {
      EXPECT_LT((proxy.update({0.025, 0.027, 0.023}).p_W - rest).norm(), 1e-12) << "vibrates in update " << i;
    }
  }
}

TEST(GodObject, FollowsTheGroovesOfAConcaveEdgeWithoutVibration) {
  // The hand moves along a groove in y with an opening angle of 120°, touching it from above.
  GodObject proxy = proxy_at(
      {0, 0, 0.02}, {touchable(height_mesh(0.1, 20, [](double x, double) { return std::abs(x) / std::sqrt(3.0); }))});
  drag(proxy, {0, -0.03, -0.005}, 30);
  const double height = kGodObjectRadius_m / std::cos(std::numbers::pi / 6);
  for (int i = 0; i < 200; ++i) {
    const Vec3 goal(1e-4 * std::sin(i), -0.03 + 3e-4 * i, -0.005);
    const ProxyState& state = proxy.update(goal);
    EXPECT_LT((state.p_W - Vec3(0, goal.y(), height)).norm(), 1e-9) << i;
    EXPECT_EQ(state.faults, 0);
  }
}

TEST(GodObject, ProjectsOntoPrimitives) {
  struct Case {
    std::shared_ptr<const contact::ExactField> field;
    Vec3 goal;
    Vec3 expected;
  };
  const Vec3 on_sphere = Vec3(0.010, 0.004, 0.012).normalized();
  const std::vector<Case> cases{
      {contact::sphere_field(0.02), 0.016 * on_sphere, 0.021 * on_sphere},
      {contact::box_field(Vec3(0.04, 0.04, 0.04)), {0.003, 0.004, 0.015}, {0.003, 0.004, 0.021}},
      {contact::cylinder_field(0.02, 0.1), {0.015, 0, 0.004}, {0.021, 0, 0.004}},
      {contact::capsule_field(0.02, 0.1), {0, 0, 0.066}, {0, 0, 0.071}}};
  for (const Case& one : cases) {
    const Pose X_WB{{0.1, -0.2, 0.3}, quaternion_of({0.3, 0.5, -0.7})};
    GodObject proxy = proxy_at(X_WB * (3.0 * one.expected), {touchable(one.field, X_WB)});
    drag(proxy, X_WB * one.goal, 100);
    EXPECT_LT((proxy.state().p_W - X_WB * one.expected).norm(), kSettled_m) << one.goal.transpose();
  }
}

TEST(GodObject, OnASphereMeshIsTheProjectionUpToItsFacets) {
  const double radius = 0.03;
  const int cuts = 5;
  GodObject proxy = proxy_at({0, 0, 0.05}, {touchable(contact::sphere_mesh(radius, cuts))});
  // Two errors of a mesh whose facets have sides of length s, for a sphere of radius R. A facet is s²/6R inside the
  // sphere, and it is tilted by up to s/(√3 R). The tilt displaces the proxy by tilt × depth.
  const double side = radius * std::numbers::pi / 2 / (1 << cuts) * 1.5;
  const double tilt = side / (std::sqrt(3.0) * radius);
  Random random(3);
  Vec3 direction = Vec3::UnitZ();
  for (int i = 0; i < 2000; ++i) {
    direction = (direction + 0.01 * Vec3(random.normal(), random.normal(), random.normal())).normalized();
    const Vec3 goal = (radius - 0.003) * direction;
    const Vec3 p = proxy.update(goal).p_W;
    EXPECT_LE(p.norm(), radius + kGodObjectRadius_m + kSettled_m);
    EXPECT_GE(p.norm(), radius + kGodObjectRadius_m - side * side / (6 * radius) - kSettled_m);
    EXPECT_LT((p.normalized() - direction).norm() * radius, tilt * (0.003 + kGodObjectRadius_m) + side) << i;
  }
}

TEST(GodObject, IsStoppedBySheetsFromBothSides) {
  for (const double side : {-1.0, 1.0}) {
    GodObject proxy = proxy_at({0, 0, side * 0.02}, {touchable(flat_mesh())});
    drag(proxy, {0.001, 0.002, -side * 0.03}, 3);
    EXPECT_LT((proxy.state().p_W - Vec3(0.001, 0.002, side * kGodObjectRadius_m)).norm(), 1e-9);
  }
}

TEST(GodObject, MovesAroundTheRimOfASheetOnlyIfTheHandDoes) {
  GodObject proxy = proxy_at({0, 0, 0.01}, {touchable(flat_mesh())});
  drag(proxy, {0, 0, -0.01}, 20);
  drag(proxy, {0.099, 0, -0.01}, 200);
  EXPECT_NEAR(proxy.state().p_W.z(), kGodObjectRadius_m, 1e-9);
  drag(proxy, {0.11, 0, -0.01}, 50);
  EXPECT_LT((proxy.state().p_W - Vec3(0.11, 0, -0.01)).norm(), 1e-9);
  EXPECT_FALSE(proxy.state().is_touching);
}

TEST(GodObject, ClimbsAStepLowerThanItsRadius) {
  // A block that is 0.4 mm high lies on a floor. The block begins at x = 0.
  GodObject proxy = proxy_at({-0.01, 0, 0.01}, {touchable(contact::half_space_field()),
                                                touchable(contact::box_mesh({0.04, 0.04, 0.0008}, {0.02, 0, 0}))});
  drag(proxy, {-0.005, 0, 0.0005}, 20);
  EXPECT_LT((proxy.state().p_W - Vec3(-0.005, 0, kGodObjectRadius_m)).norm(), 1e-9);
  // The ball is pulled along the floor to the block. Its centre is higher than the rim of the block, so the horizontal
  // distance of the centre from the rim is less than the radius.
  drag(proxy, {-0.00075, 0, 0.0005}, 50);
  const double gap = std::sqrt(kGodObjectRadius_m * kGodObjectRadius_m - 0.0006 * 0.0006);
  EXPECT_NEAR(proxy.state().p_W.x(), -gap, kSettled_m);
  drag(proxy, {0.005, 0, 0.0005}, 100);
  EXPECT_LT((proxy.state().p_W - Vec3(0.005, 0, 0.0004 + kGodObjectRadius_m)).norm(), kSettled_m);
}

TEST(GodObject, SlidesOverTheSeamOfFlushBodies) {
  GodObject proxy =
      proxy_at({-0.01, 0, 0.01}, {touchable(contact::box_field(Vec3(0.02, 0.02, 0.02)), at({-0.01, 0, -0.01})),
                                  touchable(contact::box_field(Vec3(0.02, 0.02, 0.02)), at({0.01, 0, -0.01})),
                                  touchable(contact::box_mesh({0.02, 0.02, 0.02}, {0.03, 0, -0.01}))});
  drag(proxy, {-0.01, 0, -0.002}, 10);
  for (int i = 1; i <= 450; ++i) {
    const double x = -0.01 + 1e-4 * i;
    const Vec3 p = proxy.update({x, 0, -0.002}).p_W;
    EXPECT_LT((p - Vec3(x, 0, kGodObjectRadius_m)).norm(), 2e-5) << i;
  }
}

TEST(GodObject, TheSameUpdatesGiveTheSameBits) {
  const auto run = [] {
    GodObject proxy = proxy_at({0, 0, 0.05}, {touchable(contact::sphere_mesh(0.03, 3))}, true);
    Random random(8);
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 500; ++i) {
      sum += proxy.update(Vec3(random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03), 0.02)).p_W;
    }
    return sum;
  };
  EXPECT_EQ(run(), run());
}

TEST(GodObject, StaysFiniteAndOutsideForHostileInput) {
  const std::array<double, 8> values{kNan, kInfinity, -kInfinity, 1e300, -1e300, 1e-300, 0.0, 0.01};
  std::vector<ProxyObstacle> obstacles{with_friction(touchable(contact::sphere_mesh(0.03, 3)), 0.5, 0.3),
                                       touchable(contact::box_field(Vec3(0.02, 0.02, 0.02)), at({0.05, 0, 0}))};
  GodObject proxy = proxy_at({0, 0, 0.05}, obstacles, true);
  const auto law = make_coupling_law("spring-damper", {});
  Random random(12);
  const auto pick = [&] { return values[random.next_u32() % values.size()]; };
  const auto pick_vector = [&] { return Vec3(pick(), pick(), pick()); };
  for (int i = 0; i < 3000; ++i) {
    std::array<RigidState, 3> motions;
    for (RigidState& motion : motions) {
      motion.X = {pick_vector(), Quat(pick(), pick(), pick(), pick())};
      if (i % 2 == 0) motion.X.q = quaternion_of({0.1 * i, 0, 0});
      motion.V = {pick_vector(), pick_vector()};
    }
    const ProxyState& state = proxy.update(pick_vector(), std::span(motions).first(random.next_u32() % 4));
    ASSERT_TRUE(is_finite(state.p_W) && is_finite(state.goal_W)) << i;
    ASSERT_TRUE(is_finite(proxy_force_on_hand_W(state, *law, pick_vector()))) << i;
  }
  GodObject still = proxy_at({0, 0, 0.05}, {touchable(contact::sphere_mesh(0.03, 3))});
  EXPECT_EQ(still.update({kNan, 0, 0}).faults & kProxyBadInput, kProxyBadInput);
  EXPECT_EQ(still.state().p_W, Vec3(0, 0, 0.05));
  still.update({kNan, 0, 0});
  EXPECT_EQ(proxy_force_on_hand_W(still.state(), *law, Vec3::Zero()), Vec3::Zero());
}

TEST(GodObject, LeavesAMeshThatItWasPutInto) {
  GodObject proxy = proxy_at({0, 0, 0.0302}, {touchable(contact::sphere_mesh(0.03, 4))});
  for (int i = 0; i < 3000; ++i) proxy.update({0, 0, 0.02});
  EXPECT_GT(geometry::TriangleTree(contact::sphere_mesh(0.03, 4)).signed_distance_m(proxy.state().p_W),
            kGodObjectRadius_m - GodObject::kTolerance_m);
}

TEST(GodObject, HoldsWhereThereAreMoreTrianglesThanItCanKeep) {
  // The mesh is a fan of 3000 triangles that share one vertex.
  geometry::TriangleMesh fan;
  fan.vertices.emplace_back(Vec3::Zero());
  const int count = 3000;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    fan.vertices.emplace_back(0.02 * std::cos(angle), 0.02 * std::sin(angle), 0);
    fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % count});
  }
  GodObject proxy = proxy_at({0, 0, 0.01}, {touchable(fan)});
  std::uint8_t faults = 0;
  for (int i = 0; i < 100; ++i) faults |= proxy.update({0, 0, 0.01 - 2e-4 * i}).faults;
  EXPECT_NE(faults & kProxyTooDense, 0);
  EXPECT_GT(proxy.state().p_W.z(), kGodObjectRadius_m - GodObject::kTolerance_m);
}

TEST(GodObject, AnUpdateAllocatesNothing) {
  GodObject proxy = proxy_at({0, 0, 0.05}, {with_friction(touchable(contact::sphere_mesh(0.03, 4)), 0.4, 0.3)}, true);
  const auto law = make_coupling_law("spring-damper", {});
  Random random(2);
  const std::uint64_t before = test::allocation_count();
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < 500; ++i) {
    const ProxyState& state = proxy.update({random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04), 0.02});
    sum += proxy_force_on_hand_W(state, *law, Vec3::Zero());
  }
  EXPECT_EQ(test::allocation_count(), before) << sum.transpose();
}

TEST(GodObject, RefusesInvalidSettings) {
  const auto sphere = touchable(contact::sphere_field(0.01));
  EXPECT_THROW(proxy_at(Vec3::Zero(), {}, false, 0.0), std::invalid_argument);
  EXPECT_THROW(proxy_at(Vec3::Zero(), {}, false, kNan), std::invalid_argument);
  EXPECT_THROW(proxy_at({kNan, 0, 0}, {}), std::invalid_argument);
  EXPECT_THROW(proxy_at(Vec3::Zero(), {ProxyObstacle{}}), std::invalid_argument);
  EXPECT_THROW(proxy_at(Vec3::Zero(), {with_friction(sphere, 0.1, 0.2)}), std::invalid_argument);
  EXPECT_THROW(proxy_at(Vec3::Zero(), {touchable(contact::sphere_field(0.01), at({kNan, 0, 0}))}),
               std::invalid_argument);
  EXPECT_THROW(proxy_at(Vec3::Zero(), std::vector<ProxyObstacle>(GodObject::kMaxObstacles + 1, sphere)),
               std::invalid_argument);
  EXPECT_THROW(ProxyMesh(geometry::TriangleMesh{}), std::invalid_argument);
  EXPECT_THROW(ProxyMesh({{Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY()}, {{0, 1, 7}}}), std::invalid_argument);
  EXPECT_THROW(ProxyMesh({{Vec3::Zero(), Vec3::UnitX(), Vec3(kNan, 0, 0)}, {{0, 1, 2}}}), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::haptics
