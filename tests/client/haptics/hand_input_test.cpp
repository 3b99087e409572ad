// Tests the path from a device sample to the handle in the world: workspace mapping, clutch, and a change of the
// mapping.
#include "client/haptics/hand_input.hpp"

#include <gtest/gtest.h>

#include "common/base/buttons.hpp"
#include "tests/client/haptics/scripted_device.hpp"

namespace tandem::client {
namespace {

struct InputRig {
  InputRig() { input.enter({{Vec3(1, 0, 0), Quat::Identity()}, 10, 1}); }
  /// Runs one tick. Returns the result of HandInput::move().
  bool tick(bool is_quiet = false) {
    now += std::chrono::milliseconds(1);
    input.read(now);
    return input.move({.has_scene = true, .is_displaying = true, .is_quiet = is_quiet});
  }

  ScriptedDevice device;
  HandInput input{device, true};
  LocalTime now{std::chrono::seconds(1)};
};

TEST(HandInput, MapsTheSampleIntoTheWorld) {
  InputRig rig;
  rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
  rig.tick();
  EXPECT_LT((rig.input.handle_W().X.p - Vec3(1.1, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(rig.input.path_W().p, rig.input.handle_W().X.p) << "the encoder of this device is exact";
}

TEST(HandInput, KeepsTheHandleThroughAnInvalidSample) {
  InputRig rig;
  rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
  rig.tick();
  rig.device.sample.is_valid = false;
  rig.device.sample.X_DH.p = Vec3(0.5, 0, 0);
  rig.tick();
  EXPECT_LT((rig.input.handle_W().X.p - Vec3(1.1, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(rig.input.speed_m_per_s(), 0);
}

TEST(HandInput, TheSpeedIsTheLargerOfTheReportedAndTheMovedOne) {
  InputRig rig;
  rig.device.sample.V_DH.v = Vec3(0.2, 0, 0);
  rig.tick();
  EXPECT_DOUBLE_EQ(rig.input.speed_m_per_s(), 0.2) << "no sample before";
  rig.device.sample.X_DH.p = Vec3(0.001, 0, 0);
  rig.tick();
  EXPECT_NEAR(rig.input.speed_m_per_s(), 1, 1e-9);
  rig.tick();
  EXPECT_DOUBLE_EQ(rig.input.speed_m_per_s(), 0.2);
}

TEST(HandInput, TheClutchFreezesTheHandleButNotTheUnclutchedPath) {
  InputRig rig;
  rig.tick();
  rig.device.sample.buttons = kButtonClutch;
  rig.tick();
  rig.device.sample.X_DH.p = Vec3(0.001, 0, 0);
  rig.tick();
  EXPECT_TRUE(rig.input.is_clutched());
  EXPECT_EQ(rig.input.handle_W().X.p, Vec3(1, 0, 0));
  EXPECT_EQ(rig.input.path_W().p, Vec3(1, 0, 0));
  EXPECT_NEAR(rig.input.unclutched_path_W().p.x(), 1.01, 1e-12);
}

TEST(HandInput, AChangedMappingWaitsUntilNoForceIsDisplayed) {
  InputRig rig;
  rig.tick();
  rig.input.change({{Vec3(1, 0, 0), Quat::Identity()}, 20, 1});
  EXPECT_TRUE(rig.input.is_clutched());
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(rig.tick(false));
  EXPECT_EQ(rig.input.mapping().position_scale, 10);
  EXPECT_TRUE(rig.tick(true));
  EXPECT_EQ(rig.input.mapping().position_scale, 20);
  EXPECT_FALSE(rig.tick(true));
  EXPECT_FALSE(rig.input.is_clutched());
}

TEST(HandInput, WithoutASceneTheHandleStays) {
  InputRig rig;
  rig.tick();
  rig.device.sample.X_DH.p = Vec3(0.001, 0, 0);
  rig.now += std::chrono::milliseconds(1);
  rig.input.read(rig.now);
  EXPECT_FALSE(rig.input.move({.has_scene = false}));
  EXPECT_EQ(rig.input.handle_W().X.p, Vec3(1, 0, 0));
  EXPECT_EQ(rig.input.path_D().p, Vec3(0.001, 0, 0));
}

}  // namespace
}  // namespace tandem::client
