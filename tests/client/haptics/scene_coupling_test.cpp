// Tests how the coupling law and coefficients of a scene message reach the hand: within bounds, and by ramps and fades
// without steps.
#include "client/haptics/scene_coupling.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string_view>

#include "common/haptics/coupling/laws.hpp"

namespace tandem::client {
namespace {

constexpr haptics::CouplingParameters kBounds{.stiffness_n_per_m = 3000, .damping_n_s_per_m = 20};

constexpr double kSceneCouplingTick_s = 0.001;

HapticScene scene_of(std::string_view law, double stiffness_n_per_m) {
  HapticScene scene;
  scene.law = static_cast<std::size_t>(haptics::find_coupling_law(law) - haptics::coupling_laws().data());
  scene.coupling.stiffness_n_per_m = stiffness_n_per_m;
  return scene;
}

TEST(SceneCoupling, StartsASceneWithItsLawAndCoefficientsAtOnce) {
  SceneCoupling coupling(kBounds);
  coupling.start(scene_of("spring-damper", 700));
  EXPECT_EQ(coupling.law().name(), "spring-damper");
  EXPECT_EQ(coupling.parameters().stiffness_n_per_m, 700);
  coupling.start(scene_of("stable-dynamic", 300));
  EXPECT_EQ(coupling.law().name(), "stable-dynamic");
  EXPECT_EQ(coupling.parameters().stiffness_n_per_m, 300);
}

TEST(SceneCoupling, BoundsTheCouplingOfAScene) {
  SceneCoupling coupling(kBounds);
  coupling.start(scene_of("spring-damper", 1e6));
  EXPECT_EQ(coupling.parameters().stiffness_n_per_m, kBounds.stiffness_n_per_m);
}

TEST(SceneCoupling, RampsAChangeInATenthOfASecondUnlessItJumps) {
  SceneCoupling coupling(kBounds);
  coupling.start(scene_of("spring-damper", 300));
  coupling.fade_to(scene_of("spring-damper", 600));
  for (int i = 1; i <= 50; ++i) {
    coupling.advance(kSceneCouplingTick_s);
    ASSERT_NEAR(coupling.parameters().stiffness_n_per_m, 300 + 3 * i, 1e-9) << i << " ms";
  }
  coupling.jump();
  EXPECT_EQ(coupling.parameters().stiffness_n_per_m, 600);
}

TEST(SceneCoupling, FadesToAnotherLawInThreeTenthsOfASecondUnlessItJumps) {
  SceneCoupling coupling(kBounds);
  haptics::CouplingState stretched;
  stretched.d_W = {0.01, 0, 0};
  const auto force_n = [&] { return coupling.law().wrench_on_tool_W(stretched).f.x(); };
  const auto run = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) coupling.advance(kSceneCouplingTick_s);
  };
  coupling.start(scene_of("stable-dynamic", 300));
  run(1);
  const double before_n = force_n();
  coupling.fade_to(scene_of("spring-damper", 300));
  run(150);
  EXPECT_NEAR(force_n(), (before_n + 3) / 2, 1e-9) << "half way";
  run(151);
  EXPECT_EQ(coupling.law().name(), "spring-damper");
  EXPECT_NEAR(force_n(), 3, 1e-12);
  coupling.fade_to(scene_of("stable-dynamic", 300));
  run(10);
  coupling.jump();
  EXPECT_EQ(force_n(), before_n);
}

TEST(SceneCoupling, DetectsAnUnusableScene) {
  EXPECT_TRUE(SceneCoupling::is_usable(scene_of("spring-damper", 300)));
  EXPECT_FALSE(SceneCoupling::is_usable(scene_of("spring-damper", std::numeric_limits<double>::quiet_NaN())));
  HapticScene scene;
  scene.law = haptics::coupling_laws().size();
  EXPECT_FALSE(SceneCoupling::is_usable(scene));
}

}  // namespace
}  // namespace tandem::client
