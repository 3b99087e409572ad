// Tests bodies that leave the scene, and ids of bodies that do not exist.
#include <gtest/gtest.h>

#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {
namespace {

constexpr BodyId kA{1};

/// Returns a cube without support, 0.5 m below the upper limit of a scene with bounds of 1 m.
WorldDescription falling() {
  WorldDescription description = world_of({cube({0, 0, 0.5}, 0.3)}, {ball_tool({0, 0, 0.6})});
  description.gravity_m_per_s2 = {0, 0, -9.81};
  description.limits.bounds_m = 1;
  return description;
}

TEST(SceneBounds, ABodyThatLeavesReturnsToItsStartAtRest) {
  World world = client_world(falling());
  world.set_body(kA, at({0, 0, -0.9}, {0, 0, -1}));
  int steps = 0;
  while (world.returned_bodies().empty() && steps < 1000) {
    const TickFaults faults = world.step();
    EXPECT_EQ((faults & kFaultOutOfBounds) != 0, !world.returned_bodies().empty());
    ++steps;
  }
  EXPECT_NEAR(steps, 101, 1);
  ASSERT_EQ(world.returned_bodies().size(), 1U);
  EXPECT_EQ(world.returned_bodies()[0], kA);
  EXPECT_EQ(world.body(kA).X.p, Vec3(0, 0, 0.5));
  EXPECT_EQ(world.body(kA).V.v, Vec3(0, 0, 0));
  EXPECT_EQ(world.step(), 0U);
  EXPECT_TRUE(world.returned_bodies().empty()) << "reported once";
}

TEST(SceneBounds, AHandMayCarryABodyAnywhere) {
  World world = client_world(falling());
  world.activate_tool(0);
  world.set_body(kA, at({0, 0, -1.2}));
  world.hold(0, kA, Pose{});
  world.set_handle(0, at({0, 0, -1.2}));
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(world.step() & kFaultOutOfBounds, 0U);
    ASSERT_LT(world.body(kA).X.p.z(), -1.1);
  }
}

TEST(RemovedBody, HasNoContactsUntilItsPoseIsReceived) {
  WorldDescription description = world_of({cube({0, 0, 0}, 0.3)}, {ball_tool({-0.05, 0, 0})});
  const auto push = [](World& world) {
    double force_n = 0;
    for (int i = 0; i < 100; ++i) {
      world.set_handle(0, at({-0.05 + 5e-4 * i, 0, 0}));
      world.step();
      force_n = std::max(force_n, world.touch(0).force_n);
    }
    return force_n;
  };
  World without_body = client_world(description);
  without_body.remove_body(kA);
  without_body.activate_tool(0);
  EXPECT_EQ(push(without_body), 0) << "a body without a received pose must not be felt at its start";
  EXPECT_EQ(without_body.grab(0, kA), GrabResult::kOutOfReach);
  World with = client_world(description);
  with.remove_body(kA);
  with.set_body(kA, at({0, 0, 0}));
  with.activate_tool(0);
  EXPECT_GT(push(with), 0.5);
}

TEST(RemovedBody, CannotBeMovedUntilItsPoseIsReceived) {
  WorldDescription description =
      world_of({table(), cube({0, 0, 0.1}, 0.3), cube({0.1, 0, 0.02}, 0.3)}, {ball_tool({0.1, 0, 0.02})});
  description.gravity_m_per_s2 = {0, 0, -9.81};
  const BodyId fallen{2}, held{3};
  ExternalBodies external;
  World world = server_world(description, &external);
  world.remove_body(fallen);
  world.remove_body(fallen);
  EXPECT_EQ(external, (ExternalBodies{0, 2}));
  run(world, 500);
  EXPECT_EQ(world.body(fallen).X.p.z(), 0.1) << "it does not fall";
  world.return_all();
  run(world, 2);
  EXPECT_EQ(external, (ExternalBodies{0, 2})) << "nor does a reset bring it back";
  world.set_body(fallen, at({0, 0, 0.1}));
  EXPECT_EQ(external, (ExternalBodies{0, 1, 2}));
  run(world, 500);
  EXPECT_NEAR(world.body(fallen).X.p.z(), 0.02, 1e-3) << "on the table";
  // If a body is removed while a tool holds it, the tool must release it.
  world.activate_tool(0);
  world.hold(0, held, Pose{});
  world.set_handle(0, at({0.1, 0, 0.02}));
  run(world, 5);
  world.remove_body(held);
  EXPECT_FALSE(world.tool(0).held.is_valid());
  EXPECT_EQ(run(world, 400), 0U) << "no fault in any step";
  EXPECT_EQ(external, (ExternalBodies{0, 1}));
  world.hold(0, held, Pose{});
  EXPECT_EQ(external, (ExternalBodies{0, 1})) << "the touch stage moves it";
  world.release(0);
  run(world, 400);
  EXPECT_EQ(external, (ExternalBodies{0, 1, 2}));
}

}  // namespace
}  // namespace tandem::physics
