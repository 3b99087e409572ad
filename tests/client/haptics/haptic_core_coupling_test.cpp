// Tests the scene's coupling in the whole tick: law, limits, ramp and clutch.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/client/haptics/haptic_rig.hpp"

namespace tandem::client {
namespace {

TEST(HapticCore, AForceThatIsAllowedAgainIsRampedAndTheClutchedHandleStaysWhereItWas) {
  HapticRig rig;
  rig.enter_scene();
  rig.device.sample.buttons = kButtonClutch;
  rig.run(10);
  rig.device.sample.X_DH.p = Vec3(0.02, 0, 0);
  rig.run(10);
  rig.device.sample.buttons = 0;
  rig.run(1);
  rig.scene.may_display = false;
  rig.scene.coupling.stiffness_n_per_m = 2500;
  rig.mailboxes.scene.publish(rig.scene);
  rig.device.sample.X_DH.p = Vec3(0.021, 0, 0);
  rig.run(700);
  ASSERT_NEAR(rig.sent().handle.X.p.x(), 0.001, 1e-12);
  rig.scene.may_display = true;
  rig.scene.coupling.stiffness_n_per_m = 1000;
  rig.mailboxes.scene.publish(rig.scene);
  double last_n = 0;
  for (int i = 0; i < 600; ++i) {
    rig.run(1);
    ASSERT_NEAR(rig.sent().handle.X.p.x(), 0.001, 1e-12);
    // Bound of the rise of the force per tick. At a stretch of 1 mm, the force is at most 2.5 N, even with the old
    // stiffness of 2500 N/m. The start ramp scales it from 0 to 1 in 500 ticks.
    ASSERT_LE(std::abs(rig.force().x()) - last_n, 2.5 / 500 + 1e-9) << i << " ms";
    last_n = std::abs(rig.force().x());
  }
  EXPECT_NEAR(rig.force().x(), -1, 1e-9);
}

TEST(HapticCore, WhatWasRefusedIsNotFeltOnTheWayToSomethingBetter) {
  HapticRig rig;
  rig.enter_scene();
  rig.scene.may_display = false;
  rig.scene.coupling.stiffness_n_per_m = 3000;
  rig.mailboxes.scene.publish(rig.scene);
  rig.device.sample.X_DH.p = Vec3(0.001, 0, 0);
  rig.run(50);
  rig.scene.coupling.stiffness_n_per_m = 300;  // must not be displayed before may_display is set
  rig.mailboxes.scene.publish(rig.scene);
  rig.run(50);
  rig.scene.may_display = true;
  rig.mailboxes.scene.publish(rig.scene);
  for (int i = 1; i <= 500; ++i) {
    rig.run(1);
    ASSERT_LE(std::abs(rig.force().x()), 0.3 * i / 500 + 1e-9) << i << " ms";
  }
  EXPECT_NEAR(rig.force().x(), -0.3, 1e-3);
}

TEST(HapticCore, AfterTheRampLatePoseIsTheCouplingThroughTheWorkspaceMapping) {
  HapticRig rig;
  rig.scene.workspace.X_WD = {Vec3(1, 0, 0), quaternion_of(Vec3(0, 0, std::acos(-1.0) / 2))};
  rig.scene.workspace.position_scale = 2;
  rig.scene.workspace.force_scale = 0.5;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
  rig.received.update.tool.X.p = Vec3(1, 0, 0);
  rig.run(700);
  // The mapping turns 5 mm along the device's x axis into 10 mm along the world's y axis. The spring of 300 N/m pulls
  // the handle back with 3 N. Because of the force scale ½, the user feels 1.5 N along −x of the device.
  EXPECT_LT((rig.core.record().handle_W.X.p - Vec3(1, 0.01, 0)).norm(), 1e-12);
  EXPECT_LT((rig.force() - Vec3(-1.5, 0, 0)).norm(), 1e-9);
}

TEST(HapticCore, ParameterChangeIsReachedInATenthOfASecondWithoutAStep) {
  HapticRig rig;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0, 0.002, 0);
  rig.run(700);
  EXPECT_NEAR(rig.force().y(), -0.6, 1e-9);
  rig.scene.coupling.stiffness_n_per_m = 600;
  rig.mailboxes.scene.publish(rig.scene);
  for (int i = 1; i <= 100; ++i) {
    rig.run(1);
    ASSERT_NEAR(rig.force().y(), -0.6 - 0.006 * i, 1e-9) << i;
  }
  rig.run(50);
  EXPECT_NEAR(rig.force().y(), -1.2, 1e-9);
}

TEST(HapticCore, RendersTheScenesLaw) {
  for (const char* name : {"spring-damper", "stable-dynamic", "qsa-dynamic"}) {
    HapticRig rig;
    rig.scene.law = law_index(name);
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.004, 0, 0);
    rig.run(700);
    haptics::CouplingState state;
    state.d_W = Vec3(0.004, 0, 0);
    const Vec3 expected = haptics::make_coupling_law(name, rig.scene.coupling)->wrench_on_tool_W(state).f;
    EXPECT_LT((rig.force() + expected).norm(), 1e-9) << name;
  }
}

TEST(HapticCore, AnotherLawOfTheSameSceneFadesInWithoutAStep) {
  for (const char* name : {"stable-dynamic", "qsa-dynamic", "stable-dynamic-literal", "adaptive"}) {
    HapticRig rig;
    rig.scene.law = law_index("spring-damper");
    rig.scene.coupling.stiffness_n_per_m = 400;
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.008, 0, 0);
    rig.run(700);
    EXPECT_NEAR(rig.force().x(), -3.2, 1e-9);
    rig.scene.law = law_index(name);
    rig.mailboxes.scene.publish(rig.scene);
    Vec3 before = rig.force();
    for (int i = 1; i <= 310; ++i) {
      rig.run(1);
      ASSERT_LT((rig.force() - before).norm(), 0.02) << name << ", " << i << " ms";
      before = rig.force();
    }
    haptics::CouplingState state;
    state.d_W = Vec3(0.008, 0, 0);
    const Vec3 expected = haptics::make_coupling_law(name, rig.scene.coupling)->wrench_on_tool_W(state).f;
    EXPECT_LT((rig.force() + expected).norm(), 1e-9) << name;
  }
}

TEST(HapticCore, AnInvalidSceneDisplaysNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<HapticScene> scenes(7);
  scenes[0].coupling.stiffness_n_per_m = nan;
  scenes[1].coupling.damping_n_s_per_m = -1;
  scenes[2].workspace.position_scale = 0;
  scenes[3].workspace.force_scale = std::numeric_limits<double>::infinity();
  scenes[4].workspace.X_WD.q = Quat(2, 0, 0, 0);
  scenes[5].law = haptics::coupling_laws().size();
  scenes[6].coupling.curve_sharpness = nan;
  for (const HapticScene& scene : scenes) {
    HapticRig rig;
    rig.scene = scene;
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
    rig.run(700);
    EXPECT_EQ(rig.core.counters().force_max_n, 0);
    EXPECT_FALSE(rig.sent().handle_valid);
  }
}

TEST(HapticCore, StiffnessFromTheWireIsBoundedByTheClient) {
  HapticRig rig;
  rig.scene.coupling.stiffness_n_per_m = 1e6;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.0001, 0, 0);
  rig.run(700);
  EXPECT_NEAR(rig.force().x(), -0.3, 1e-9) << "3000 N/m · 0.1 mm, not 100 N";
}

TEST(HapticCore, TheBoundIsOnWhatTheDeviceFeelsWhateverTheScale) {
  // The handle moves ten times as far as the device, and its force is scaled by five. The stiffness at the device is
  // therefore 50 times that of the scene.
  HapticRig rig;
  rig.scene.workspace.position_scale = 10;
  rig.scene.workspace.force_scale = 5;
  rig.scene.coupling.stiffness_n_per_m = 1e6;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.0001, 0, 0);
  rig.run(700);
  EXPECT_NEAR(rig.force().x(), -0.3, 1e-9) << "3000 N/m · 0.1 mm at the device";
}

TEST(HapticCore, ASharpCurveIsBoundedByItsSteepestSlope) {
  HapticRig rig;
  rig.scene.law = law_index("stable-dynamic");
  rig.scene.coupling.stiffness_n_per_m = 1e6;
  rig.scene.coupling.curve_sharpness = 10;
  rig.scene.coupling.force_limit_n = 1;
  rig.enter_scene();
  rig.run(700);
  double steepest_n_per_m = 0, last_n = 0;
  for (int i = 1; i < 200; ++i) {
    rig.device.sample.X_DH.p = Vec3(5e-6 * i, 0, 0);
    rig.run(1);
    steepest_n_per_m = std::max(steepest_n_per_m, (-rig.force().x() - last_n) / 5e-6);
    last_n = -rig.force().x();
  }
  EXPECT_LE(steepest_n_per_m, 3000 * 1.001);
  EXPECT_GT(steepest_n_per_m, 2900);
}

TEST(HapticCore, ClutchKeepsTheHandleAndFadesTheForceWithoutAStepAtEitherEdge) {
  HapticRig rig;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
  rig.device.sample.V_DH.v = Vec3(0, 0.5, 0);  // the damper's force follows this velocity, and vanishes at once when
                                               // the handle is frozen
  rig.run(700);
  const double before_n = rig.force().norm();
  ASSERT_GT(rig.core.record().displayed_on_hand_D.f.dot(Vec3(0, -1, 0)), 0.5) << "the damper is felt";
  rig.device.sample.buttons = kButtonClutch;
  Vec3 last = rig.force();
  for (int i = 0; i < 50; ++i) {
    rig.run(1);
    rig.device.sample.X_DH.p.y() += 0.0005;
    ASSERT_LT((rig.core.record().handle_W.X.p - Vec3(0.005, 0, 0)).norm(), 1e-12);
    ASSERT_EQ(rig.core.record().handle_W.V.v, Vec3::Zero());
    ASSERT_LE((rig.force() - last).norm(), 0.1 + 1e-9) << i << " ms: no step";
    ASSERT_TRUE(i < std::max(20.0, before_n / 0.1 + 2) || rig.force().isZero(0)) << i;
    ASSERT_TRUE(rig.core.record().safety_faults & haptics::kSafetyClutched);
    ASSERT_FALSE(rig.core.record().safety_faults & haptics::kSafetySilence);
    last = rig.force();
  }
  const proto::ClientUpdate& sent = rig.sent();
  EXPECT_TRUE(sent.handle_valid) << "the tool stays where it is, held by the server";
  EXPECT_EQ(sent.buttons, kButtonClutch);
  rig.device.sample.buttons = 0;
  for (int i = 0; i < 600; ++i) {
    rig.run(1);
    ASSERT_LE((rig.force() - last).norm(), before_n / 500 + 1e-9) << i << " ms: linear over the 0.5 s of the ramp";
    last = rig.force();
  }
  EXPECT_NEAR(rig.force().norm(), before_n, 1e-9);
}

TEST(HapticCore, ClutchOfAnyLengthDoesNoMoreWorkThanTwentyMillisecondsOfTheForceBefore) {
  for (const int pressed_ticks : {1, 15, 100, 5000}) {
    HapticRig rig;
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
    rig.run(700);
    const double force_n = rig.force().norm();
    ASSERT_NEAR(force_n, 1.5, 1e-9);
    const double before_j = rig.core.counters().energy_to_hand_j;
    rig.device.sample.buttons = kButtonClutch;
    for (int i = 0; i < pressed_ticks; ++i) {
      rig.device.sample.X_DH.p.x() -= 0.0005;  // the hand yields to the force
      rig.run(1);
    }
    const double most_j = force_n * 0.0005 * 20;
    EXPECT_LE(rig.core.counters().energy_to_hand_j - before_j, most_j) << pressed_ticks << " ms";
  }
}

}  // namespace
}  // namespace tandem::client
