// Tests a small device workspace in a large scene. The force must have no steps at the border of the workspace, when
// its scale changes, while the clutch is pressed, and when the user releases the device.
#include "client/haptics/hand_workspace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/client/haptics/haptic_rig.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::client {
namespace {

constexpr double kStep_n = 0.1;  // largest permitted force change per millisecond
constexpr double kHalf_m = 0.05, kInner_m = 0.04;
const Vec3 kWorkspace_m = Vec3::Constant(2 * kHalf_m);

struct SmallRig : HapticRig {
  /// With the stage "hold", the user feels the server's force, which is zero for a free tool. With "late-pose", the
  /// user feels a spring to the tool, which is at rest.
  explicit SmallRig(const std::string& stage = "late-pose") : HapticRig(stage, false, kWorkspace_m) {}
  /// Runs one tick that moves the hand to `p`.
  void move_to(const Vec3& p) {
    device.sample.V_DH.v = (p - device.sample.X_DH.p) / 0.001;
    device.sample.X_DH.p = p;
    const Vec3 before = force();
    run(1);
    steepest_n = std::max(steepest_n, (force() - before).norm());
  }
  void stay(int ticks) {
    for (int i = 0; i < ticks; ++i) move_to(device.sample.X_DH.p);
  }
  double x_W() const { return core.record().handle_W.X.p.x(); }
  double steepest_n = 0;
};

TEST(HandWorkspace, AScaledAndTurnedMappingKeepsTheHandsPower) {
  const std::uint64_t seed = test::test_seed(7);
  SCOPED_TRACE("TANDEM_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  const auto any = [&random] { return Vec3(random.normal(), random.normal(), random.normal()); };
  for (int i = 0; i < 100; ++i) {
    const WorkspaceMapping scene{{any(), quaternion_of(any())}, random.uniform(0.2, 5), random.uniform(0.2, 5)};
    const WorkspaceMapping own = with_user(scene, {random.uniform(0.1, 10), random.uniform(-3, 3)});
    const Twist hand{any(), any()};
    const Wrench world{any(), any()};
    const Wrench on_hand = own.device_wrench(world);
    const Twist moved = own.world_twist(hand);
    const double hand_w = on_hand.f.dot(hand.v) + on_hand.t.dot(hand.w);
    const double world_w = world.f.dot(moved.v) + world.t.dot(moved.w);
    EXPECT_NEAR(hand_w, scene.hand_joules_per_world_joule() * world_w, 1e-9 * std::max(1.0, std::abs(hand_w)));
  }
}

TEST(HandWorkspace, BeyondTheBorderTheToolGoesOnAWallIsFeltAndNothingSteps) {
  SmallRig rig("hold");
  rig.enter_scene();
  rig.stay(700);
  for (double x = 0; x < 0.048; x += 0.0003) rig.move_to(Vec3(x, 0, 0));  // at 0.3 m/s
  rig.move_to(Vec3(0.048, 0, 0));
  const double before_m = rig.x_W();
  rig.stay(1000);
  // The workspace drifts while the hand is between the inner border (40 mm) and the outer border (50 mm). At 48 mm, the
  // hand is at the fraction 0.8 between them. The workspace therefore moves by 0.8² of its width per second.
  EXPECT_NEAR(rig.x_W() - before_m, 0.64 * 2 * kHalf_m, 0.005);
  EXPECT_NEAR(rig.force().x(), -0.8 * 2, 0.02) << "a quarter of 8 N is 2 N";
  for (double x = 0.048; x > 0; x -= 0.0003) rig.move_to(Vec3(x, 0, 0));
  const double back_m = rig.x_W();
  rig.stay(300);
  EXPECT_NEAR(rig.x_W(), back_m, 1e-9) << "within, it is the hand alone";
  EXPECT_NEAR(rig.force().norm(), 0, 1e-6);
  EXPECT_LE(rig.steepest_n, kStep_n + 1e-9);
}

TEST(HandWorkspace, AtTheBorderItPressesNoHarderThanHalfTheDevice) {
  SmallRig rig;
  rig.enter_scene();
  rig.stay(700);
  for (double x = 0; x < 0.003; x += 1e-5) rig.move_to(Vec3(x, 0, 0));  // 3 mm from the tool: 0.9 N
  rig.received.update.tool.X.p.x() = 0.049;
  for (double x = 0.003; x < 0.049; x += 1e-4) rig.move_to(Vec3(x, 0, 0));
  for (int i = 0; i < 60'000; ++i) rig.stay(1);
  const Vec3 of_scene = rig.core.record().stage_wrench_on_hand_D.f;
  EXPECT_LE(of_scene.norm(), 4.0 + 0.01);
  EXPECT_GE(of_scene.norm(), 3.5) << "it moves until the force reaches the limit";
}

TEST(HandWorkspace, ADeviceLaidDownAtItsBorderStopsAfterThreeWidthsAndAHandThatComesBackGoesOn) {
  SmallRig rig("hold");
  rig.enter_scene();
  rig.stay(700);
  double begin_m = 0;
  for (int stroke = 1; stroke <= 2; ++stroke) {
    for (double x = 0; x < 0.049; x += 0.0003) rig.move_to(Vec3(x, 0, 0));
    rig.stay(20'000);
    const double at_m = rig.x_W();
    EXPECT_LE(at_m - begin_m, 3 * 2 * kHalf_m + kHalf_m);
    EXPECT_GT(at_m - begin_m, 0.28);
    rig.stay(20'000);
    EXPECT_NEAR(rig.x_W(), at_m, 1e-6) << "the workspace must have stopped";
    EXPECT_NEAR(rig.force().x(), -0.9 * 2, 0.1) << "the wall stays";
    for (double x = 0.049; x > 0; x -= 0.0003) rig.move_to(Vec3(x, 0, 0));
    begin_m = rig.x_W();
  }
  EXPECT_LE(rig.steepest_n, kStep_n + 1e-9);
}

/// Tests random hands that push, tremble, rest or press the clutch, on devices and in scenes of all sizes. Fails if the
/// workspace moves farther than three widths while the hand stays at the border.
TEST(HandWorkspace, NoHandDrivesItsBaseFartherThanThreeWidthsWithoutComingBack) {
  const std::uint64_t seed = test::test_seed(9);
  SCOPED_TRACE("TANDEM_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  const auto any = [&random] { return Vec3(random.normal(), random.normal(), random.normal()); };
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    devices::DeviceSpec device;
    device.workspace_m = Vec3(random.uniform(0.03, 0.4), random.uniform(0.03, 0.4), random.uniform(0.03, 0.4));
    device.force_limit_n = random.uniform(0, 10);
    const Vec3 half = device.workspace_m / 2;
    HandWorkspace workspace(device, true);
    workspace.enter({{any(), quaternion_of(any())}, random.uniform(0.1, 10), random.uniform(0.1, 10)});
    const double scale = workspace.mapping().position_scale;
    const double most_m = 3 * device.workspace_m.maxCoeff();
    Vec3 p = Vec3::Zero();
    double way_m = 0;
    for (int stretch = 0; stretch < 12; ++stretch) {
      const Vec3 to = random.uniform(0, 1) < 0.3 ? Vec3(Vec3::Zero()) : Vec3(1.2 * any().cwiseProduct(half));
      const double tremor_m = random.uniform(0, 1) < 0.5 ? 0 : random.uniform(0, 0.02) * half.minCoeff();
      const Vec3 force = random.uniform(0, 1) < 0.5 ? Vec3(Vec3::Zero()) : Vec3(3 * any());
      const double period_s = random.uniform(1e-5, 0.01);
      if (random.uniform(0, 1) < 0.2) workspace.rest();
      for (int tick = 0; tick < 3000; ++tick) {
        p += 0.01 * (to - p) + tremor_m * any();
        const Vec3 before = workspace.mapping().X_WD.p, rate_before = workspace.rate_W();
        workspace.advance(p, force, period_s);
        const double moved_m = (workspace.mapping().X_WD.p - before).norm() / scale;
        const auto share = [&] { return p.cwiseAbs().cwiseQuotient(half).maxCoeff(); };
        if (share() <= 0.7) way_m = 0;
        way_m += moved_m;
        ASSERT_LE(way_m, most_m * (1 + 1e-9)) << stretch << " " << tick;
        if (share() <= 0.8) {
          ASSERT_EQ(moved_m, 0);
        }
        ASSERT_TRUE(workspace.mapping().X_WD.p.allFinite() && workspace.wall_on_hand_D().allFinite());
        ASSERT_LE(workspace.wall_on_hand_D().cwiseAbs().maxCoeff(), 2.0);
        // While the hand rests, only the limit of the workspace's travel may change the drift rate. In a period T, the
        // rate may change by at most 3 T times the workspace width.
        if (tremor_m == 0 && tick > 2500) {
          ASSERT_LE((workspace.rate_W() - rate_before).norm() / scale, 3 * period_s * device.workspace_m.norm() + 1e-9);
        }
      }
    }
  }
}

TEST(HandWorkspace, AHandThatStartsAtTheBorderFeelsNoForceAtFirst) {
  SmallRig rig("hold");
  rig.device.sample.X_DH.p = Vec3(0, -0.049, 0);
  rig.enter_scene();
  rig.stay(1000);
  EXPECT_EQ(rig.core.record().handle_W.X.p, Vec3(0, -0.049, 0));
  EXPECT_NEAR(rig.force().norm(), 0, 1e-6);
  for (double y = -0.049; y < 0; y += 1e-4) rig.move_to(Vec3(0, y, 0));
  for (double y = 0; y > -0.049; y -= 1e-4) rig.move_to(Vec3(0, y, 0));
  EXPECT_GT(rig.force().y(), 1.5) << "once it was within";
}

TEST(HandWorkspace, WithoutABorderItIsAsItWas) {
  HapticRig rig;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.3, 0, 0);
  rig.run(1000);
  EXPECT_EQ(rig.core.record().handle_W.X.p, Vec3(0.3, 0, 0));
}

TEST(HandWorkspace, AnotherScaleUnderLoadNeitherMovesTheToolNorStepsTheForce) {
  SmallRig rig;
  rig.enter_scene();
  rig.stay(700);
  for (double x = 0; x < 0.01; x += 2e-5) rig.move_to(Vec3(x, 0, 0));
  rig.stay(100);
  const double before_m = rig.x_W(), before_n = rig.force().norm();
  EXPECT_GT(before_n, 2.5);
  rig.scene.workspace = with_user({}, {2, std::numbers::pi / 2});
  rig.mailboxes.scene.publish(rig.scene);
  double least_n = before_n;
  for (int i = 0; i < 1500; ++i) {
    rig.stay(1);
    least_n = std::min(least_n, rig.force().norm());
    ASSERT_NEAR(rig.x_W(), before_m, 1e-12) << i;
  }
  EXPECT_EQ(least_n, 0) << "let go in between";
  EXPECT_NEAR(rig.force().norm(), 2 * before_n, 0.05 * before_n) << "and as much more as the motion is";
  EXPECT_LE(rig.steepest_n, kStep_n + 1e-9);
  rig.move_to(rig.device.sample.X_DH.p + Vec3(0, -1e-4, 0));
  EXPECT_NEAR(rig.x_W() - before_m, 2e-4, 1e-9) << "turned by a quarter, and twice as far";
}

TEST(HandWorkspace, ClutchingUnderLoadAndFromTheBorderStepsNoForce) {
  SmallRig rig;
  rig.enter_scene();
  rig.stay(700);
  for (double x = 0; x < 0.02; x += 2e-5) rig.move_to(Vec3(x, 0, 0));
  EXPECT_GT(rig.force().norm(), 5);
  for (const std::uint32_t buttons : {std::uint32_t{kButtonClutch}, 0U}) {
    rig.device.sample.buttons = buttons;
    for (int i = 0; i < 100; ++i) rig.move_to(rig.device.sample.X_DH.p - Vec3(1e-4, 0, 0));
    rig.stay(600);
  }
  EXPECT_LE(rig.steepest_n, kStep_n + 1e-9);
}

/// The user releases a device on which 5 N act. Only the mass of the device resists that force, so its speed trips the
/// safety chain.
TEST(HandWorkspace, ALimpHandUnderLoadIsCutAndArmedAgainByTheRamp) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 5, 0);
  rig.run(700);
  ASSERT_NEAR(rig.force().y(), 5, 1e-9);
  constexpr double kMass_kg = 0.15;
  Vec3& v = rig.device.sample.V_DH.v;
  int fast_ticks = 0, ticks = 0;
  for (; ticks < 100 && !rig.force().isZero(0); ++ticks) {
    v += 0.001 / kMass_kg * rig.device.last.f;
    rig.device.sample.X_DH.p += 0.001 * v;
    rig.run(1);
    fast_ticks += v.norm() > 1 ? 1 : 0;
  }
  EXPECT_LE(fast_ticks, 20) << "too long faster than 1 m/s before the force is cut";
  EXPECT_LE(ticks, 50) << "too long until the force is cut";
  EXPECT_LE(v.norm(), 1.5);
  EXPECT_TRUE(rig.core.record().safety_faults & haptics::kSafetyTooFast);
  v.setZero();  // the user holds the device again
  Vec3 last = rig.force();
  for (int i = 0; i < 600; ++i) {
    rig.run(1);
    ASSERT_LE((rig.force() - last).norm(), 5.0 / 500 + 1e-9) << i;
    last = rig.force();
  }
  EXPECT_NEAR(rig.force().y(), 5, 1e-9);
}

}  // namespace
}  // namespace tandem::client
