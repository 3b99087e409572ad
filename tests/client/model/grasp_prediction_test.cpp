// Tests the predicted grasp against the grasp that the server confirms: when the prediction remains, and when it is
// replaced.
#include "client/model/grasp_prediction.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "common/physics/followed_bodies.hpp"
#include "proto/world_from_wire.hpp"

namespace tandem::client {
namespace {

constexpr BodyId kGraspedBlock = body_id_at(0);
constexpr double kGripStep_m = 1e-5;

MassProperties grasp_mass_of(double mass_kg) {
  MassProperties mass;
  mass.mass_kg = mass_kg;
  mass.principal_inertia_kg_m2 = Vec3::Constant(mass_kg * 1e-4);
  return mass;
}

physics::TouchModel grasp_touch_of(std::shared_ptr<const contact::ContactShape> shape) {
  return proto::touch_model_of({{std::move(shape), Pose{}}}, 1e10);
}

/// A graspable block with a tool that touches it.
std::shared_ptr<const physics::WorldDescription> grasp_scene() {
  auto world = std::make_shared<physics::WorldDescription>();
  physics::BodyDescription block;
  block.touch = grasp_touch_of(contact::make_contact_box(Vec3::Constant(0.04)));
  block.mass = grasp_mass_of(0.5);
  block.is_graspable = true;
  world->bodies = {block};
  physics::ToolDescription tool;
  tool.touch = grasp_touch_of(contact::make_contact_sphere(0.005));
  tool.mass = grasp_mass_of(0.03);
  tool.X_WT.p.x() = 0.024;
  world->tools = {tool};
  world->coupling.law = "spring-damper";
  return world;
}

struct GraspRig {
  GraspRig() { world.activate_tool(0, false); }
  bool press(bool is_down, std::uint64_t input) {
    return grasp.follow_button(is_down, Tick{input}, LocalTime(std::chrono::milliseconds(input)), world, 0);
  }
  /// Simulates a server state that includes the input of tick `input`. At that step, the newest buttons that the server
  /// had received were those sent at the time `echoed` [ms].
  bool answer(BodyId held, std::uint64_t input, std::uint64_t echoed) {
    proto::ServerUpdate update;
    update.held_body = held;
    update.answered_input = Tick{input};
    update.echoed_sent = LocalTime(std::chrono::milliseconds(echoed));
    return grasp.mirror(update, world.tool(0).tool.X, kGripStep_m, world, 0);
  }
  BodyId held() const { return world.tool(0).held; }

  physics::World world{grasp_scene(), physics::make_followed_bodies(1), nullptr};
  GraspPrediction grasp;
};

TEST(GraspPrediction, GrabsAtTheButtonAndReleasesAtItsEnd) {
  GraspRig rig;
  EXPECT_TRUE(rig.press(true, 10));
  EXPECT_EQ(rig.held(), kGraspedBlock);
  EXPECT_FALSE(rig.press(true, 11)) << "no change of the button";
  EXPECT_TRUE(rig.press(false, 12));
  EXPECT_FALSE(rig.held().is_valid());
}

TEST(GraspPrediction, RemainsUntilTheServerHasAnsweredIt) {
  GraspRig rig;
  rig.press(true, 10);
  EXPECT_FALSE(rig.answer(BodyId{}, 14, 14)) << "within 5 ticks";
  EXPECT_FALSE(rig.answer(BodyId{}, 30, 9)) << "the button was lost on the way";
  EXPECT_EQ(rig.held(), kGraspedBlock);
  EXPECT_TRUE(rig.answer(BodyId{}, 15, 15)) << "refused";
  EXPECT_FALSE(rig.held().is_valid());
}

TEST(GraspPrediction, IsConfirmedWithoutAJump) {
  GraspRig rig;
  rig.press(true, 10);
  EXPECT_FALSE(rig.answer(kGraspedBlock, 15, 15));
  EXPECT_EQ(rig.held(), kGraspedBlock);
}

TEST(GraspPrediction, FollowsAGraspThatWasNotPredicted) {
  GraspRig rig;
  EXPECT_TRUE(rig.answer(kGraspedBlock, 1, 1));
  EXPECT_EQ(rig.held(), kGraspedBlock);
  EXPECT_TRUE(rig.answer(BodyId{}, 2, 2));
  EXPECT_FALSE(rig.held().is_valid());
}

}  // namespace
}  // namespace tandem::client
