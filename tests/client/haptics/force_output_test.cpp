// Tests the path from the computed wrench to the device: the part of a clamped force that comes from the scene,
// commands that the device refuses, and the sums of work.
#include "client/haptics/force_output.hpp"

#include <gtest/gtest.h>

#include "tests/client/haptics/scripted_device.hpp"

namespace tandem::client {
namespace {

struct OutputRig {
  void write(const Vec3& scene_n, const Vec3& own_n = Vec3::Zero(), bool is_ready = true) {
    now += std::chrono::milliseconds(1);
    haptics::SafetyInput conditions;
    conditions.has_state = true;
    output.write(now, {scene_n, Vec3::Zero()}, own_n, conditions, is_ready);
  }
  /// Runs until the start ramp has ended.
  void settle(const Vec3& scene_n, const Vec3& own_n = Vec3::Zero()) {
    for (int i = 0; i < 700; ++i) write(scene_n, own_n);
  }

  ScriptedDevice device;
  ForceOutput output{{}, device};
  LocalTime now{std::chrono::seconds(1)};
};

TEST(ForceOutput, DisplaysTheSceneWithBorderAndNudge) {
  OutputRig rig;
  rig.settle({2, 0, 0}, {0, 1, 0});
  EXPECT_LT((rig.device.last.f - Vec3(2, 1, 0)).norm(), 1e-9);
  EXPECT_LT((rig.output.displayed_of_scene_D().f - Vec3(2, 0, 0)).norm(), 1e-9);
}

TEST(ForceOutput, BorderAndNudgeKeepTheirShareOfAClampedForce) {
  OutputRig rig;
  rig.settle({12, 0, 0}, {4, 0, 0});
  EXPECT_TRUE(rig.output.was_clamped());
  EXPECT_NEAR(rig.output.displayed_D().f.x(), 8, 1e-9);
  EXPECT_NEAR(rig.output.displayed_of_scene_D().f.x(), 6, 1e-9);
}

TEST(ForceOutput, ADeviceThatIsNotReadyGetsZero) {
  OutputRig rig;
  rig.settle({2, 0, 0});
  rig.write({2, 0, 0}, Vec3::Zero(), false);
  EXPECT_TRUE(rig.device.last.f.isZero(0));
}

TEST(ForceOutput, ARefusedCommandIsCountedAndThePreviousOneRemainsDisplayed) {
  OutputRig rig;
  rig.settle({2, 0, 0});
  rig.device.accepts = false;
  rig.write({3, 0, 0});
  EXPECT_EQ(rig.output.write_failures(), 1U);
  EXPECT_EQ(rig.output.displayed_D().f, Vec3(2, 0, 0));
  EXPECT_FALSE(rig.output.write_zero(rig.now));
  EXPECT_EQ(rig.output.write_failures(), 2U);
  rig.device.accepts = true;
  EXPECT_TRUE(rig.output.write_zero(rig.now));
  EXPECT_TRUE(rig.output.displayed_D().f.isZero(0));
}

TEST(ForceOutput, SumsTheWorkOfTheDisplayedWrenchAlongTheKnownPath) {
  OutputRig rig;
  rig.settle({2, 0, 0});
  Pose X_DH;
  rig.output.move_to(X_DH);
  X_DH.p.x() = 0.001;
  rig.output.move_to(X_DH);
  EXPECT_NEAR(rig.output.work().to_hand_j(), 2e-3, 1e-12);
  rig.output.lose_pose();
  X_DH.p.x() = 0.5;
  rig.output.move_to(X_DH);
  X_DH.p.x() = 0.499;
  rig.output.move_to(X_DH);
  EXPECT_NEAR(rig.output.work().to_hand_j(), 2e-3, 1e-12);
  EXPECT_NEAR(rig.output.work().from_hand_j(), 2e-3, 1e-12);
}

TEST(ForceOutput, IsQuietAfterTheShutdownRamp) {
  OutputRig rig;
  rig.settle({2, 0, 0});
  rig.output.begin_shutdown();
  for (int i = 0; i < 20; ++i) rig.write({2, 0, 0});
  EXPECT_TRUE(rig.output.is_quiet());
}

}  // namespace
}  // namespace tandem::client
