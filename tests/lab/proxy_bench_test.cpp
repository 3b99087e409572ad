#include "lab/contact/proxy_bench.hpp"

#include <gmock/gmock.h>

#include "lab/contact/mesh_generators.hpp"

namespace tandem::lab {
namespace {

TEST(CrossingJudge, SeesWaysThroughASurfaceAndNoOthers) {
  const CrossingJudge judge(make_sphere(0.03, 3));
  EXPECT_TRUE(judge.crosses({0.04, 0.001, 0.002}, {0.02, 0.001, 0.002}));
  EXPECT_TRUE(judge.crosses({-0.04, 0.001, 0.002}, {0.04, 0.002, 0.001}));
  EXPECT_FALSE(judge.crosses({-0.04, 0, 0.031}, {0.04, 0, 0.031}));
  EXPECT_FALSE(judge.crosses({-0.01, 0, 0.002}, {0.01, 0.003, 0.001}));
  EXPECT_FALSE(judge.crosses({0.04, 0.001, 0.002}, {0.04, 0.001, 0.002}));
}

TEST(ProxyBench, HandStaysFiveMillimetresBehindASphereAtItsSpeed) {
  const std::vector<Vec3> hand = wandering_hand(make_sphere(0.03, 4), 3000);
  for (std::size_t i = 1; i < hand.size(); ++i) {
    EXPECT_LE((hand[i] - hand[i - 1]).norm(), 2e-4 + 1e-12);
    // Drawn behind an ellipsoid's nearest point, not an exact projection; the chords of the sphere are 0.1 mm inside.
    if (i > 500) {
      EXPECT_NEAR(hand[i].norm(), 0.025, 5e-4) << i;
    }
  }
}

TEST(ProxyBench, TellsAProxyFromAClosestPointLoop) {
  const TriangleMesh mesh = make_cube(0.05);
  const std::vector<Vec3> hand = wandering_hand(mesh, 4000);
  const VirtualClock clock;
  const TriangleTree tree(mesh);
  const CrossingJudge judge(mesh);
  const ProxyRun ours = run_god_object(std::make_shared<const ProxyMesh>(mesh), {}, hand, clock);
  const ProxyFigures figures = figures_of({ours}, tree, judge, 1e-3);
  EXPECT_LE(figures.max_penetration_m, GodObject::kTolerance_m);
  EXPECT_EQ(figures.pop_throughs, 0U);
  const ProxyFigures plain = figures_of({run_closest_point(tree, 1e-3, hand, clock)}, tree, judge, 1e-3);
  EXPECT_GT(plain.max_penetration_m, 5e-3);
}

}  // namespace
}  // namespace tandem::lab
