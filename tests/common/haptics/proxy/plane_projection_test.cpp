#include "common/haptics/proxy/plane_projection.hpp"

#include <gmock/gmock.h>

#include <vector>

#include "common/base/random.hpp"

namespace tandem::haptics {
namespace {

Vec3 random_vector(Random& random) {
  return {random.normal(), random.normal(), random.normal()};
}

TEST(PlaneProjection, WithoutPlanesIsTheGoal) {
  PlaneProjection projection;
  projection.start({1, 2, 3});
  EXPECT_EQ(projection.point(), Vec3(1, 2, 3));
  EXPECT_TRUE(projection.active().empty());
}

TEST(PlaneProjection, LoadsAreTheDepthsInACorner) {
  PlaneProjection projection;
  projection.start({-1, -2, -3});
  for (int axis = 0; axis < 3; ++axis) ASSERT_TRUE(projection.add({Vec3::Unit(axis), 0.5}, axis));
  EXPECT_LT((projection.point() - Vec3::Constant(0.5)).norm(), 1e-15);
  ASSERT_EQ(projection.active().size(), 3U);
  for (const auto& active : projection.active()) EXPECT_NEAR(active.load_m, 1.5 + active.tag, 1e-15);
}

TEST(PlaneProjection, DropsAPlaneThatAnotherOneMakesIdle) {
  PlaneProjection projection;
  projection.start({0, 0, -1});
  ASSERT_TRUE(projection.add({Vec3(0, 0.6, 0.8), 0}, 1));
  ASSERT_TRUE(projection.add({Vec3::UnitZ(), 1}, 2));
  ASSERT_EQ(projection.active().size(), 1U);
  EXPECT_EQ(projection.active()[0].tag, 2);
  EXPECT_LT((projection.point() - Vec3(0, 0, 1)).norm(), 1e-15);
}

TEST(PlaneProjection, ReportsThatNoPointIsAboveAllPlanes) {
  PlaneProjection projection;
  projection.start({0, 0, 0});
  ASSERT_TRUE(projection.add({Vec3::UnitZ(), 1}, 1));
  EXPECT_FALSE(projection.add({-Vec3::UnitZ(), 1}, 2));
  EXPECT_EQ(projection.point(), Vec3(0, 0, 1));
}

// Checks the Karush-Kuhn-Tucker conditions. For a convex problem, only the optimum satisfies them.
TEST(PlaneProjection, MeetsTheConditionsOfTheOptimumForRandomPlanes) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int round = 0; round < 2000; ++round) {
    std::vector<AllowedSide> sides;
    // The origin satisfies all constraints, just as the proxy's position satisfies the constraints of its planes.
    for (int i = 0; i < 12; ++i) sides.push_back({random_vector(random).normalized(), -random.uniform()});
    PlaneProjection projection;
    const Vec3 goal = 3 * random_vector(random);
    projection.start(goal);
    for (int added = 0; added < 200; ++added) {
      int violated = -1;
      for (int i = 0; i < 12; ++i) {
        if (sides[static_cast<std::size_t>(i)].height_m(projection.point()) < -1e-10) violated = i;
      }
      if (violated < 0) break;
      ASSERT_TRUE(projection.add(sides[static_cast<std::size_t>(violated)], violated)) << "seed " << kSeed;
      ASSERT_LT(added, 100) << "does not end; seed " << kSeed << ", round " << round;
    }
    Vec3 pull = goal;
    for (const auto& active : projection.active()) {
      EXPECT_GE(active.load_m, 0);
      EXPECT_NEAR(active.side.height_m(projection.point()), 0, 1e-10);
      pull += active.load_m * active.side.normal;
    }
    EXPECT_LT((pull - projection.point()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace tandem::haptics
