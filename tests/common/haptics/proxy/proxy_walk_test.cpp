// Tests long random walks of the hand, with jumps. The ball must always stay outside of the obstacle, and on the same
// side of a sheet.
#include <gmock/gmock.h>

#include "common/base/random.hpp"
#include "tests/common/haptics/proxy/proxy_scenes.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

constexpr int kSteps = 100'000;
constexpr double kJump_m = 0.05;
constexpr double kRadius_m = 1e-3;

struct Walk {
  geometry::TriangleMesh mesh;
  Vec3 start;
  Vec3 low;  ///< the goal is clamped to the box from `low` to `high`
  Vec3 high;
  double friction = 0;
};

/// Checks in every step that the exact distance to the obstacle is at least the ball's radius. The sign of the distance
/// shows the side; for a sheet, the sign is valid only away from the rim.
void expect_outside(const Walk& walk) {
  const geometry::TriangleTree tree(walk.mesh);
  GodObject proxy = proxy_at(walk.start, {with_friction(touchable(walk.mesh), walk.friction, walk.friction)}, true);
  const std::uint64_t seed = test::test_seed(17);
  Random random(seed);
  Vec3 goal = walk.start;
  Vec3 drift = Vec3::Zero();
  const auto anywhere = [&] { return Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)); };
  int touching = 0;
  for (int i = 0; i < kSteps; ++i) {
    if (random.uniform() < 0.005) goal += kJump_m / std::sqrt(3.0) * anywhere();
    drift = 0.98 * drift + 5e-5 * anywhere();
    goal = (goal + drift).cwiseMax(walk.low).cwiseMin(walk.high);
    const ProxyState& state = proxy.update(goal);
    touching += state.is_touching ? 1 : 0;
    ASSERT_GT(tree.signed_distance_m(state.p_W), kRadius_m - GodObject::kTolerance_m)
        << "TANDEM_TEST_SEED=" << seed << ", step " << i;
  }
  EXPECT_GT(touching, kSteps / 10) << "the walk tests little";
}

TEST(ProxyWalk, NeverEntersASphere) {
  expect_outside({contact::sphere_mesh(0.03, 4), {0, 0, 0.05}, Vec3::Constant(-0.04), Vec3::Constant(0.04)});
}

TEST(ProxyWalk, NeverEntersARoughSphere) {
  Random random(4);
  geometry::TriangleMesh mesh = contact::sphere_mesh(0.03, 4);
  for (Vec3& vertex : mesh.vertices) vertex *= random.uniform(0.97, 1.03);
  expect_outside({mesh, {0, 0, 0.05}, Vec3::Constant(-0.04), Vec3::Constant(0.04), 0.5});
}

TEST(ProxyWalk, NeverPassesAThinSheet) {
  const geometry::TriangleMesh sheet =
      height_mesh(1.0, 200, [](double x, double y) { return 0.003 * std::sin(300 * x) * std::cos(200 * y); });
  expect_outside({sheet, {0, 0, 0.02}, {-0.1, -0.1, -0.05}, {0.1, 0.1, 0.05}});
}

TEST(ProxyWalk, NeverLeavesABowl) {
  const geometry::TriangleMesh bowl = height_mesh(0.2, 100, [](double x, double y) { return 20 * (x * x + y * y); });
  expect_outside({bowl, {0, 0, 0.05}, {-0.04, -0.04, -0.05}, {0.04, 0.04, 0.08}, 0.3});
}

TEST(ProxyWalk, NeverEntersTheBunny) {
  TANDEM_NEEDS_FILES(contact::kBunnyFile);
  expect_outside({contact::bunny_mesh(0.1), {0, 0, 0.08}, {-0.04, -0.04, -0.03}, {0.04, 0.04, 0.03}, 0.2});
}

}  // namespace
}  // namespace tandem::haptics
