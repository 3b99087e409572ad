// Tests bodies on springs in a scene, in both stages that can move them.
#include <gtest/gtest.h>

#include "common/physics/untouched_bodies.hpp"
#include "server/room/server_world.hpp"
#include "tests/common/physics/external_bodies.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::physics {
namespace {

constexpr BodyId kBlock{1};
constexpr double kMass_kg = 0.2;

/// Returns a world with a block of 4 cm at the origin, on an anchor. `more` is JSON of further bodies. `external`
/// receives the indices of the untouched bodies.
World world_with_block(ExternalBodies& external, const std::string& anchor, const std::string& more = "",
                       const std::string& rest = "") {
  const std::string block =
      R"({"name": "block", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "graspable": true, "mass_kg": 0.2,
          "anchor": {)" +
      anchor + "}}";
  const auto scene = load_parts(
      {.bodies = block + more, .tools = R"({"name": "t", "placement": {"position_m": [-0.03, 0, 0]}})", .rest = rest});
  return {std::shared_ptr<const WorldDescription>(scene, &scene->world),
          watched(make_untouched_bodies(scene->world), external), nullptr};
}

TickFaults run(World& world, int steps) {
  TickFaults faults = 0;
  for (int i = 0; i < steps; ++i) faults |= world.step();
  return faults;
}

TEST(AnchoredBody, HangsByWeightOverStiffness) {
  ExternalBodies external;
  World world = world_with_block(external, R"("stiffness_n_per_m": 400, "damping_n_s_per_m": 10)");
  EXPECT_EQ(run(world, 2000), 0U);
  EXPECT_TRUE(external.contains(0));
  EXPECT_NEAR(world.body(kBlock).X.p.z(), -kMass_kg * 9.81 / 400, 1e-7) << "at rest from 0.02 mm/s on";
}

TEST(AnchoredBody, StandsOnATableAsStiffAsTheAnchorMayBe) {
  // The top of the table is 5 mm above the lower side of the block, so contact and spring push against each other. A
  // solver that treats them alternately would oscillate.
  ExternalBodies external;
  World world = world_with_block(external, R"("stiffness_n_per_m": 1e5, "damping_n_s_per_m": 1e4)",
                                 R"(, {"name": "table", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}],
            "placement": {"position_m": [0, 0, -0.065]}})");
  EXPECT_EQ(run(world, 2000) & ~kFaultSpeedLimited, 0U);
  double low = 1, high = -1;
  for (int i = 0; i < 500; ++i) {
    world.step();
    low = std::min(low, world.body(kBlock).X.p.z());
    high = std::max(high, world.body(kBlock).X.p.z());
  }
  EXPECT_LT(high - low, 1e-5) << "it rests";
  EXPECT_GT(low, 0) << "between where the spring and where the table has it";
  EXPECT_LT(high, 0.0051);
}

TEST(AnchoredBody, ComesBackWhenAToolReleasesIt) {
  ExternalBodies external;
  World world = world_with_block(external, R"("stiffness_n_per_m": 300, "damping_n_s_per_m": 8)", "",
                                 R"("gravity_m_per_s2": [0, 0, 0])");
  world.activate_tool(0);
  const auto hold_at = [&world](double x) { world.set_handle(0, {{{x, 0, 0}, Quat::Identity()}, {}}); };
  for (int i = 0; i < 1000; ++i) {
    hold_at(-0.03 + 2e-5 * i);
    world.step();
  }
  run(world, 1000);
  const double moved_m = world.body(kBlock).X.p.x();
  EXPECT_FALSE(external.contains(0));
  EXPECT_GT(moved_m, 5e-4);
  EXPECT_NEAR(300 * moved_m, -world.tool(0).wrench_on_hand_W.f.x(), 1e-3);
  hold_at(-0.1);
  run(world, 2000);
  EXPECT_TRUE(external.contains(0));
  EXPECT_LT(world.body(kBlock).X.p.norm(), 1e-6);
  EXPECT_LT(rotation_vector(world.body(kBlock).X.q).norm(), 1e-4);
}

}  // namespace
}  // namespace tandem::physics
