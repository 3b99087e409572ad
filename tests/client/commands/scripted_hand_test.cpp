// Tests the hand of the device "mouse" under commands: it must move to its target at the specified speed, and stop
// where a force balances it.
#include "client/commands/scripted_hand.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "devices/mouse/mouse_device.hpp"

namespace tandem::client {
namespace {

class ScriptedHandTest : public ::testing::Test {
 protected:
  ScriptedHandTest() {
    view_.workspace.X_WD = {Vec3(0.1, 0.2, 0.3), Quat(Eigen::AngleAxisd(0.5, Vec3::UnitZ()))};
    view_.workspace.position_scale = 2;
    view_.record.scene_generation = 1;
  }

  /// Runs the main thread every 10 ms and the haptic thread every 1 ms.
  void run(double for_s, const Wrench& on_hand_D = {}) {
    for (const LocalTime end = now_ + from_seconds(for_s); now_ < end;) {
      now_ += std::chrono::milliseconds(1);
      device_.write(now_, on_hand_D);
      view_.record.sample = device_.read(now_);
      fastest_m_per_s_ = std::max(fastest_m_per_s_, view_.record.sample.V_DH.v.norm());
      if (milliseconds() % 10 == 0) hand_.follow(view_, now_);
    }
  }
  std::int64_t milliseconds() const { return now_.time_since_epoch() / std::chrono::milliseconds(1); }
  Pose X_WH() const { return view_.workspace.world_pose(view_.record.sample.X_DH); }

  std::shared_ptr<devices::Pointer> pointer_ = std::make_shared<devices::Pointer>();
  devices::MouseDevice device_{devices::DeviceSpec(), devices::MouseDevice::default_hand(), pointer_};
  ScriptedHand hand_{pointer_};
  View view_;
  LocalTime now_{std::chrono::seconds(5)};
  double fastest_m_per_s_ = 0;
};

TEST_F(ScriptedHandTest, MovesToAPositionWithItsSpeedLimitAndRestsThere) {
  run(0.5);
  const Pose goal{Vec3(0.3, 0.1, 0.4), Quat(Eigen::AngleAxisd(1.5, Vec3(1, 2, 2).normalized()))};
  hand_.move_to(goal, now_);
  run(0.2);
  EXPECT_FALSE(hand_.has_arrived());
  EXPECT_FALSE(hand_.is_at_rest(now_));
  run(3);
  EXPECT_TRUE(hand_.has_arrived());
  EXPECT_TRUE(hand_.is_at_rest(now_));
  EXPECT_LT((X_WH().p - goal.p).norm(), 1e-4);
  EXPECT_LT(rotation_vector(X_WH().q * goal.q.conjugate()).norm(), 1e-3);
  EXPECT_LT(fastest_m_per_s_, 1.2 * ScriptedHand::kSpeed_m_per_s) << "a hand with a mass swings a little";
}

TEST_F(ScriptedHandTest, AForceThatHoldsItUpStretchesItNoFartherThanAMouseMay) {
  run(0.5);
  hand_.move_to(view_.workspace.world_pose({Vec3(0.4, 0, 0), Quat::Identity()}), now_);
  run(6, {Vec3(-30, 0, 0), Vec3::Zero()});
  EXPECT_FALSE(hand_.has_arrived());
  const double stretch_m = (hand_.target().X_DH.p - view_.record.sample.X_DH.p).norm();
  EXPECT_LE(stretch_m, ScriptedHand::kMaxStretch_m + 0.002);
}

TEST_F(ScriptedHandTest, AnotherSceneEndsTheMovementAndReleasesTheButtons) {
  run(0.1);
  hand_.press(kButtonGrab, true);
  hand_.move_to({Vec3(0.3, 0.1, 0.4), Quat::Identity()}, now_);
  run(0.3);
  EXPECT_EQ(view_.record.sample.buttons, kButtonGrab);
  ++view_.record.scene_generation;
  run(1);
  EXPECT_EQ(view_.record.sample.buttons, 0U);
  const Vec3 then = X_WH().p;
  run(1);
  EXPECT_LT((X_WH().p - then).norm(), 1e-4);
}

TEST(DevicePose, IsTheInverseOfTheWorkspace) {
  WorkspaceMapping workspace;
  workspace.X_WD = {Vec3(1, -2, 3), Quat(Eigen::AngleAxisd(2, Vec3(1, 1, 0).normalized()))};
  workspace.position_scale = 0.25;
  const Pose X_DH{Vec3(0.1, 0.2, -0.3), Quat(Eigen::AngleAxisd(1, Vec3::UnitX()))};
  const Pose again = device_pose(workspace, workspace.world_pose(X_DH));
  EXPECT_LT((again.p - X_DH.p).norm(), 1e-12);
  EXPECT_LT(rotation_vector(again.q * X_DH.q.conjugate()).norm(), 1e-12);
}

}  // namespace
}  // namespace tandem::client
