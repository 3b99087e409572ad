// Tests bodies on springs to their start pose (anchors). The two stages that move bodies must apply the same spring.
#include <gtest/gtest.h>

#include "tests/common/physics/world_support.hpp"

namespace tandem::physics {
namespace {

constexpr BodyId kBody{1};
constexpr double kMass_kg = 0.3;
const Vec3 kStart(0.1, -0.2, 0.3);

WorldDescription anchored(const Joint& anchor, double mass_kg = kMass_kg) {
  WorldDescription world = world_of({cube(kStart, mass_kg)}, {ball_tool({0, 0, 2})});
  world.bodies[0].anchor = anchor;
  return world;
}

/// Stage of the world that moves the anchored body: the stage of untouched bodies, or the touch stage.
enum class Owner { kUntouched, kTouchStage };

class Anchor : public ::testing::TestWithParam<Owner> {
 protected:
  void give_to_owner(World& world) {
    if (GetParam() == Owner::kTouchStage) world.keep_implicit(kBody, 3600);
    ASSERT_EQ(external_.contains(0), GetParam() == Owner::kUntouched);
  }

  ExternalBodies external_;
};

TEST_P(Anchor, MovesABodyByImplicitEulersRecurrence) {
  const Joint anchor{400, 5, 0, 0};
  World world = server_world(anchored(anchor), &external_);
  give_to_owner(world);
  double x = 0.02, v = -0.3;
  world.set_body(kBody, at(kStart + x * Vec3::UnitX(), v * Vec3::UnitX()));
  for (int i = 0; i < 500; ++i) {
    v = (kMass_kg * v - kStep_s * anchor.stiffness_n_per_m * x) /
        (kMass_kg + kStep_s * (anchor.damping_n_s_per_m + kStep_s * anchor.stiffness_n_per_m));
    x += kStep_s * v;
    ASSERT_EQ(world.step(), 0U);
    // Tolerance: the residual that the solver may leave in the equations of a step (see ContactIsland).
    ASSERT_NEAR(world.body(kBody).X.p.x() - kStart.x(), x, 1e-9) << "step " << i;
    ASSERT_NEAR(world.body(kBody).V.v.x(), v, 1e-7) << "step " << i;
  }
}

TEST_P(Anchor, HasItsNominalStiffness) {
  const Joint anchor{500, 10, 1, 0.01};
  WorldDescription description = anchored(anchor);
  description.gravity_m_per_s2 = {0, 0, -9.81};
  World world = server_world(description, &external_);
  give_to_owner(world);
  run(world, 4000);
  const Vec3 weight(0, 0, -kMass_kg * 9.81);
  EXPECT_LT((world.body(kBody).X.p - kStart - weight / 500).norm(), 1e-8);
}

TEST_P(Anchor, TurnsABodyBackByTheSameRecurrence) {
  const Joint anchor{0, 0, 0.05, 1e-4};
  World world = server_world(anchored(anchor), &external_);
  give_to_owner(world);
  const double inertia = kMass_kg * kCubeEdge_m * kCubeEdge_m / 6;
  double theta = 0.5, w = 0;
  world.set_body(kBody, {{kStart, quaternion_of(theta * Vec3::UnitY())}, {}});
  for (int i = 0; i < 500; ++i) {
    w = (inertia * w - kStep_s * anchor.stiffness_n_m_per_rad * theta) /
        (inertia + kStep_s * (anchor.damping_n_m_s_per_rad + kStep_s * anchor.stiffness_n_m_per_rad));
    theta += kStep_s * w;
    ASSERT_EQ(world.step(), 0U);
    ASSERT_LT((rotation_vector(world.body(kBody).X.q) - theta * Vec3::UnitY()).norm(), 1e-7) << "step " << i;
  }
}

TEST_P(Anchor, ABodySagsByItsWeightOverTheStiffness) {
  WorldDescription description = anchored({500, 10, 1, 0.01});
  description.gravity_m_per_s2 = {0, 0, -9.81};
  World world = server_world(description, &external_);
  give_to_owner(world);
  run(world, 3000);
  EXPECT_NEAR(world.body(kBody).X.p.z() - kStart.z(), -kMass_kg * 9.81 / 500, 1e-9);
}

/// The energy must not grow for any values. The body is displaced, rotated and thrown, and its centre of mass is not at
/// its origin.
TEST_P(Anchor, NeverStoresMoreEnergyThanItReceived) {
  for (const double mass_kg : {1e-3, 0.3, 100.0}) {
    for (const Joint& anchor : {Joint{1e5, 0, 1e4, 0}, Joint{1e5, 1e4, 1e4, 1e3}, Joint{10, 0, 0.01, 0},
                                Joint{0, 1e4, 0, 1e3}, Joint{1e5, 0, 0, 0}}) {
      WorldDescription description = anchored(anchor, mass_kg);
      description.bodies[0].mass = mass_of(mass_kg, 0.01, {0.01, 0.02, -0.01});
      World world = server_world(description, &external_);
      give_to_owner(world);
      world.set_body(kBody,
                     {{kStart + Vec3(0.01, 0, -0.02), quaternion_of({0.3, -0.2, 0.1})}, {{0.1, 0.2, 0}, {1, 0, 2}}});
      const double given = world.stored_energy_j();
      for (int i = 0; i < 1000; ++i) {
        ASSERT_EQ(world.step() & kFaultNotFinite, 0U);
        ASSERT_LE(world.stored_energy_j(), given * (1 + 1e-9))
            << mass_kg << " kg, " << anchor.stiffness_n_per_m << " N/m, step " << i;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfBothOwners, Anchor, ::testing::Values(Owner::kUntouched, Owner::kTouchStage),
                         [](const auto& owner) {
                           return owner.param == Owner::kUntouched ? "Untouched" : "TouchStage";
                         });

TEST(AnchorTouch, AToolFeelsAnAnchoredBodyAsSpringsInARow) {
  WorldDescription description = anchored({300, 20, 5, 0.05});
  // The tool is in front of the centre of the cube's left face and presses the cube to the right.
  const double left = kStart.x() - kCubeEdge_m / 2 - kBallRadius_m;
  description.tools[0].X_WT.p = {left - 1e-3, kStart.y(), kStart.z()};
  World world = server_world(description);
  world.activate_tool(0);
  world.set_handle(0, at({left + 0.02, kStart.y(), kStart.z()}));
  run(world, 3000);
  const double moved_m = world.body(kBody).X.p.x() - kStart.x();
  const double force_n = -world.tool(0).wrench_on_hand_W.f.x();
  EXPECT_NEAR(300 * moved_m, force_n, 1e-6);
  // The coupling and the anchor are springs in series with 300 N/m each; the surfaces are much stiffer. Each spring
  // therefore takes half of the displacement of 20 mm.
  EXPECT_NEAR(force_n, 300 * 0.02 / 2, 0.03);
}

TEST(AnchorTouch, AMasslessToolFeelsTheAnchor) {
  WorldDescription description = anchored({300, 20, 5, 0.05});
  description.coupling.law = "direct";
  description.coupling.dynamics = haptics::ToolDynamics::kAtHandle;
  World world = server_world(description);
  world.activate_tool(0);
  world.hold(0, kBody, Pose{});
  world.set_handle(0, at(kStart + Vec3(0, 0.01, 0)));
  run(world, 10);
  EXPECT_NEAR(world.tool(0).wrench_on_hand_W.f.y(), -300 * 0.01, 1e-9);
}

}  // namespace
}  // namespace tandem::physics
