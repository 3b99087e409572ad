#include "lab/studies/contact/proxy_bench.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <memory>

#include "lab/studies/contact/mesh_generators.hpp"

namespace tandem::lab {
namespace {

/// Returns whether the straight segment between two points counts as a pop-through of a sphere of 30 mm.
bool crosses_sphere(const Vec3& from, const Vec3& to) {
  ProxyRun run;
  run.way_W = {from, to};
  return figures_of({run}, make_sphere(0.03, 3), 1e-3).pop_throughs == 1;
}

TEST(ProxyBench, SeesWaysThroughASurfaceAndNoOthers) {
  EXPECT_TRUE(crosses_sphere({0.04, 0.001, 0.002}, {0.02, 0.001, 0.002}));
  EXPECT_TRUE(crosses_sphere({-0.04, 0.001, 0.002}, {0.04, 0.002, 0.001}));
  EXPECT_FALSE(crosses_sphere({-0.04, 0, 0.031}, {0.04, 0, 0.031}));
  EXPECT_FALSE(crosses_sphere({-0.01, 0, 0.002}, {0.01, 0.003, 0.001}));
  EXPECT_FALSE(crosses_sphere({0.04, 0.001, 0.002}, {0.04, 0.001, 0.002}));
}

TEST(ProxyBench, HandStaysFiveMillimetresBehindASphereAtItsSpeed) {
  const std::vector<Vec3> hand = wandering_hand(make_sphere(0.03, 4), 3000);
  for (std::size_t i = 1; i < hand.size(); ++i) {
    EXPECT_LE((hand[i] - hand[i - 1]).norm(), 2e-4 + 1e-12);
    // The hand is about 5 mm below the surface of a sphere of 30 mm, but not exactly: the mesh consists of flat
    // triangles, which lie up to 0.1 mm inside the sphere and shift the closest points sideways.
    if (i > 500) {
      EXPECT_NEAR(hand[i].norm(), 0.025, 5e-4) << i;
    }
  }
}

TEST(ProxyBench, DistinguishesAProxyFromAClosestPointLoop) {
  const geometry::TriangleMesh mesh = make_cube(0.05);
  const std::vector<Vec3> hand = wandering_hand(mesh, 4000);
  const VirtualClock clock;
  const geometry::TriangleTree tree(mesh);
  const ProxyRun ours = run_god_object(std::make_shared<const haptics::ProxyMesh>(mesh), {}, hand, clock);
  const ProxyFigures figures = figures_of({ours}, mesh, 1e-3);
  EXPECT_LE(figures.max_penetration_m, haptics::GodObject::kTolerance_m);
  EXPECT_EQ(figures.pop_throughs, 0U);
  const ProxyFigures plain = figures_of({run_closest_point(tree, 1e-3, hand, clock)}, mesh, 1e-3);
  // The ball is at the closest point and thus outside the cube. However, it jumps through the cube from one side to the
  // opposite one.
  EXPECT_LE(plain.max_penetration_m, 1e-12);
  EXPECT_GT(plain.pop_throughs, 0U);
  EXPECT_GT(depth_of(hand, tree), 4e-3);
}

TEST(ProxyBench, PoolsTheTimesOfAllRuns) {
  ProxyRun fast, slow;
  fast.times.assign(60, std::chrono::microseconds(1));
  slow.times.assign(40, std::chrono::microseconds(9));
  const geometry::TriangleMesh mesh = make_cube(0.05);
  const TimeQuantiles times = figures_of({fast, slow}, mesh, 1e-3).loop_us;
  EXPECT_NEAR(times.p50_us, 1, 1e-9);
  EXPECT_NEAR(times.p99_us, 9, 1e-9);
}

TEST(ProxyBench, LagIsZeroBehindAHandAtRestAndNotBehindOneThatJumps) {
  const auto mesh = std::make_shared<const haptics::ProxyMesh>(make_sphere(0.03, 4));
  std::vector<Vec3> hand(50, Vec3(0, 0, 0.027));
  hand.front() = Vec3(0, 0, 0.04);
  const ProxyLag still = lag_of(mesh, {}, hand);
  EXPECT_LT(still.p50_m, 1e-6);
  EXPECT_LT(still.held_back_share, 0.1);
  // The hand changes sides in every tick, so that the proxy is often still moving at the end of a tick.
  for (std::size_t i = 1; i < hand.size(); ++i) hand[i] = Vec3(i % 2 == 0 ? 0.02 : -0.02, 0, 0.015);
  const ProxyLag jumping = lag_of(mesh, {}, hand);
  EXPECT_GT(jumping.p99_m, 1e-3);
  EXPECT_GT(jumping.held_back_share, 0.3);
}

}  // namespace
}  // namespace tandem::lab
