// The whole tick under a virtual clock, with a scripted device and hand-made server states.
#include "client/haptics/haptic_core.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "common/haptics/coupling/laws.hpp"
#include "tests/client/haptics/scripted_device.hpp"

namespace tandem::client {
namespace {

constexpr Duration kTick{std::chrono::milliseconds(1)};
// Sums of a few thousand products of order 1.
constexpr double kSumRounding = 1e-10;

/// Index of the law whose forces are known in closed form.
std::size_t law_index(std::string_view name) {
  return static_cast<std::size_t>(haptics::find_coupling_law(name) - haptics::coupling_laws().data());
}

/// Core, device and mailboxes; server states arrive when the test says so.
struct Rig {
  explicit Rig(const std::string& stage = "late-pose")
      : core({.stage = {.name = stage, .passivity = false}}, device, mailboxes) {
    scene.law = law_index("spring-damper");
  }

  void enter_scene() {
    ++scene.generation;
    scene.may_drive = scene.may_display = true;
    mailboxes.scene.publish(scene);
  }
  void receive() {
    ++received.update.step.value;
    received.received = now;
    mailboxes.inbox.publish(received);
  }
  void tick() {
    now += kTick;
    core.tick(now);
  }
  /// Ticks with a fresh state each.
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      receive();
      tick();
    }
  }
  const proto::ClientUpdate& sent() {
    EXPECT_TRUE(mailboxes.outbox.poll());
    return mailboxes.outbox.front();
  }
  Vec3 force() const { return core.record().displayed_on_hand_D.f; }

  ScriptedDevice device;
  ClientMailboxes mailboxes;
  HapticScene scene;
  ReceivedUpdate received;
  LocalTime now{std::chrono::seconds(1)};
  HapticCore core;
};

TEST(HapticCore, DisplaysNothingBeforeAScene) {
  Rig rig;
  rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
  rig.run(1000);
  EXPECT_EQ(rig.core.counters().force_max_n, 0);
  EXPECT_FALSE(rig.sent().handle_valid);
}

TEST(HapticCore, DisplaysNothingToAnObserver) {
  Rig rig;
  rig.enter_scene();
  rig.scene.may_drive = rig.scene.may_display = false;
  rig.mailboxes.scene.publish(rig.scene);
  rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
  rig.run(1000);
  EXPECT_EQ(rig.core.counters().force_max_n, 0);
}

TEST(HapticCore, AnObserverThatGetsStatesIsNotSilent) {
  Rig rig;
  rig.enter_scene();
  rig.scene.may_drive = rig.scene.may_display = false;
  rig.mailboxes.scene.publish(rig.scene);
  for (int i = 0; i < 20; ++i) rig.tick();
  rig.run(500);
  EXPECT_EQ(rig.core.record().safety_faults, haptics::kSafetyNotDisplaying);
  EXPECT_EQ(rig.core.counters().silent_ticks, 0U) << "nor while it waited for the first";
  EXPECT_EQ(rig.core.counters().not_displaying_ticks, 520U);
  for (int i = 0; i < 200; ++i) rig.tick();
  EXPECT_TRUE(rig.core.record().safety_faults & haptics::kSafetySilence) << "the states stopped";
}

TEST(HapticCore, ALostSessionDisplaysNothingAtOnceAndIsSilentOnlyLater) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  ASSERT_EQ(rig.core.counters().not_displaying_ticks, 0U);
  rig.scene.may_drive = rig.scene.may_display = false;
  rig.mailboxes.scene.publish(rig.scene);
  for (int i = 0; i < 20; ++i) rig.tick();
  EXPECT_TRUE(rig.force().isZero(0));
  EXPECT_EQ(rig.core.record().safety_faults, haptics::kSafetyNotDisplaying);
  for (int i = 0; i < 100; ++i) rig.tick();
  EXPECT_EQ(rig.core.record().safety_faults, haptics::kSafetyNotDisplaying | haptics::kSafetySilence);
}

TEST(HapticCore, WhoIsRefusedTheForceStillDrivesToolAndButtons) {
  Rig rig;
  rig.enter_scene();
  rig.device.sample.buttons = kButtonGrab;
  rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
  rig.run(700);
  ASSERT_NEAR(rig.force().x(), -1.5, 1e-9);
  rig.scene.may_display = false;
  rig.mailboxes.scene.publish(rig.scene);
  for (int i = 0; i < 300; ++i) {
    rig.device.sample.X_DH.p.y() += 1e-4;
    rig.run(1);
    const proto::ClientUpdate& sent = rig.sent();
    ASSERT_TRUE(sent.handle_valid) << i;
    ASSERT_EQ(sent.buttons, kButtonGrab) << i;
    ASSERT_EQ(sent.handle.X.p, rig.device.sample.X_DH.p) << i;
    ASSERT_TRUE(i < 20 || rig.force().isZero(0)) << i << " ms";
  }
}

TEST(HapticCore, AForceThatIsAllowedAgainIsRampedAndTheClutchedHandleStaysWhereItWas) {
  Rig rig;
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
    // 1 N over the 0.5 s of the ramp, and the coefficient's own 100 ms from 2500 N/m: at most 2.5 N over 0.5 s.
    ASSERT_LE(std::abs(rig.force().x()) - last_n, 2.5 / 500 + 1e-9) << i << " ms";
    last_n = std::abs(rig.force().x());
  }
  EXPECT_NEAR(rig.force().x(), -1, 1e-9);
}

TEST(HapticCore, WhatWasRefusedIsNotFeltOnTheWayToSomethingBetter) {
  Rig rig;
  rig.enter_scene();
  rig.scene.may_display = false;
  rig.scene.coupling.stiffness_n_per_m = 3000;
  rig.mailboxes.scene.publish(rig.scene);
  rig.device.sample.X_DH.p = Vec3(0.001, 0, 0);
  rig.run(50);
  rig.scene.coupling.stiffness_n_per_m = 300;  // checked, and only then displayed
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
  Rig rig;
  rig.scene.workspace.X_WD = {Vec3(1, 0, 0), quaternion_of(Vec3(0, 0, std::acos(-1.0) / 2))};
  rig.scene.workspace.position_scale = 2;
  rig.scene.workspace.force_scale = 0.5;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
  rig.received.update.tool.X.p = Vec3(1, 0, 0);
  rig.run(700);
  // World: the handle is 10 mm along y from the tool; 300 N/m pull it back by 3 N, of which the hand feels half,
  // along its own −x.
  EXPECT_LT((rig.core.record().handle_W.X.p - Vec3(1, 0.01, 0)).norm(), 1e-12);
  EXPECT_LT((rig.force() - Vec3(-1.5, 0, 0)).norm(), 1e-9);
}

TEST(HapticCore, HoldShowsTheServersWrench) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W = {Vec3(0, 0, 2), Vec3(0, 0.05, 0)};
  rig.run(700);
  EXPECT_LT((rig.force() - Vec3(0, 0, 2)).norm(), 1e-9);
  EXPECT_LT((rig.core.record().displayed_on_hand_D.t - Vec3(0, 0.05, 0)).norm(), 1e-9);
}

TEST(HapticCore, SilentServerMeansZeroForceWithin150MillisecondsOfTheLastArrival) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  const LocalTime last_arrival = rig.received.received;
  while (rig.now - last_arrival < std::chrono::milliseconds(59)) rig.tick();
  EXPECT_NEAR(rig.force().z(), 2, 1e-9) << "a short gap is bridged";
  while (rig.now - last_arrival < std::chrono::milliseconds(150)) rig.tick();
  EXPECT_TRUE(rig.force().isZero(0));
  EXPECT_TRUE(rig.core.record().safety_faults & haptics::kSafetySilence);
}

TEST(HapticCore, NewSceneForgetsTheOldStateAndRampsAgain) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.receive();      // still of the old connection …
  rig.enter_scene();  // … and the new one before the next tick
  for (int i = 0; i < 50; ++i) rig.tick();
  EXPECT_TRUE(rig.force().isZero(0)) << "no state of the new scene has come";
  EXPECT_LT(rig.core.record().state_age, Duration{0});
  rig.run(100);
  EXPECT_GT(rig.force().z(), 0.3);
  EXPECT_LT(rig.force().z(), 0.41) << "2 N · 0.1 s / 0.5 s";
}

TEST(HapticCore, ParameterChangeIsReachedInATenthOfASecondWithoutAStep) {
  Rig rig;
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
    Rig rig;
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

TEST(HapticCore, SceneThatMakesNoSenseDisplaysNothing) {
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
    Rig rig;
    rig.scene = scene;
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
    rig.run(700);
    EXPECT_EQ(rig.core.counters().force_max_n, 0);
    EXPECT_FALSE(rig.sent().handle_valid);
  }
}

TEST(HapticCore, StiffnessFromTheWireIsBoundedByTheClient) {
  Rig rig;
  rig.scene.coupling.stiffness_n_per_m = 1e6;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.0001, 0, 0);
  rig.run(700);
  EXPECT_NEAR(rig.force().x(), -0.3, 1e-9) << "3000 N/m · 0.1 mm, not 100 N";
}

TEST(HapticCore, TheBoundIsOnWhatTheDeviceFeelsWhateverTheScale) {
  // A hand that moves the handle ten times as far, and is pushed five times as hard, as the device: 50 times as stiff.
  Rig rig;
  rig.scene.workspace.position_scale = 10;
  rig.scene.workspace.force_scale = 5;
  rig.scene.coupling.stiffness_n_per_m = 1e6;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.0001, 0, 0);
  rig.run(700);
  EXPECT_NEAR(rig.force().x(), -0.3, 1e-9) << "3000 N/m · 0.1 mm at the device";
}

TEST(HapticCore, ASharpCurveIsBoundedByItsSteepestSlope) {
  Rig rig;
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
  Rig rig;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
  rig.device.sample.V_DH.v = Vec3(0, 0.5, 0);  // felt by the damper, and zero at once in a frozen handle
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
    ASSERT_LE((rig.force() - last).norm(), before_n / 15 + 1e-9) << i << " ms: linear over the 15 ms of the decay";
    ASSERT_TRUE(i < 20 || rig.force().isZero(0)) << i;
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
    Rig rig;
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
    rig.run(700);
    const double force_n = rig.force().norm();
    ASSERT_NEAR(force_n, 1.5, 1e-9);
    const double before_j = rig.core.counters().energy_to_hand_j;
    rig.device.sample.buttons = kButtonClutch;
    for (int i = 0; i < pressed_ticks; ++i) {
      rig.device.sample.X_DH.p.x() -= 0.0005;  // gives way to the force
      rig.run(1);
    }
    const double most_j = force_n * 0.0005 * 20;
    EXPECT_LE(rig.core.counters().energy_to_hand_j - before_j, most_j) << pressed_ticks << " ms";
  }
}

TEST(HapticCore, InvalidSamplesKeepTheButtonsForAHundredMillisecondsAndThenLetGo) {
  Rig rig;
  rig.enter_scene();
  rig.device.sample.buttons = kButtonGrab;
  rig.run(10);
  rig.device.sample.is_valid = false;
  rig.device.sample.buttons = 0;  // of an invalid sample: it says nothing
  for (int i = 1; i <= 200; ++i) {
    rig.run(1);
    const proto::ClientUpdate& sent = rig.sent();
    ASSERT_FALSE(sent.handle_valid);
    ASSERT_EQ(sent.buttons, i <= 100 ? kButtonGrab : 0U) << i << " ms";
  }
  rig.device.sample.is_valid = true;
  rig.run(1);
  EXPECT_EQ(rig.sent().buttons, 0U);
}

TEST(HapticCore, ButtonsOfAnOldSceneAreNotToldToANewOne) {
  Rig rig;
  rig.enter_scene();
  rig.device.sample.buttons = kButtonGrab;
  rig.run(10);
  rig.device.sample.is_valid = false;
  rig.enter_scene();
  rig.run(1);
  EXPECT_EQ(rig.sent().buttons, 0U);
}

TEST(HapticCore, RefusedWriteIsCountedAndTheForceComesBackByTheRamp) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.device.accepts = false;
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 3);
  rig.run(300);
  EXPECT_EQ(rig.core.counters().write_failures, 300U);
  EXPECT_EQ(rig.force(), Vec3(0, 0, 2)) << "what the device was given last";
  EXPECT_FALSE(rig.core.is_quiet());
  rig.device.accepts = true;
  rig.run(1);
  EXPECT_TRUE(rig.device.last.f.isZero(0)) << "the first that it takes";
  rig.run(250);
  EXPECT_NEAR(rig.force().z(), 1.5, 0.02) << "3 N · 0.25 s / 0.5 s";
}

TEST(HapticCore, SingleRefusedWriteIsPlayedOutToZeroBeforeTheRamp) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.device.accepts = false;
  rig.run(1);
  rig.device.accepts = true;
  int ticks = 0;
  for (; !rig.device.last.f.isZero(0) && ticks <= 20; ++ticks) rig.run(1);
  EXPECT_LE(ticks, 20);
  rig.run(100);
  EXPECT_LT(rig.force().z(), 0.45) << "2 N · 0.1 s / 0.5 s";
}

TEST(HapticCore, ZeroThatTheDeviceRefusesIsNotQuiet) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.core.begin_shutdown();
  rig.device.accepts = false;
  rig.run(100);
  EXPECT_FALSE(rig.core.write_zero(rig.now));
  EXPECT_FALSE(rig.core.is_quiet());
  rig.device.accepts = true;
  EXPECT_TRUE(rig.core.write_zero(rig.now));
  EXPECT_TRUE(rig.core.is_quiet());
}

TEST(HapticCore, EnergyIsTheSumOfForceTimesTheMotionThatFollowed) {
  Rig rig("hold");
  rig.scene.workspace.position_scale = 4;
  rig.enter_scene();
  double to_hand_j = 0;
  double from_hand_j = 0;
  double asked_to_hand_j = 0;
  Vec3 last_p = Vec3::Zero();
  Quat last_q = Quat::Identity();
  Wrench held, asked;
  for (int i = 0; i < 3000; ++i) {
    const double phase = 0.01 * i;
    rig.received.update.wrench_on_hand_W = {Vec3(std::cos(3 * phase), 0, 1), Vec3(0, 0, 0.1 * std::sin(2 * phase))};
    const Vec3 p(0.02 * std::sin(phase), 0, 0.01 * std::cos(phase));
    const Quat q = quaternion_of(Vec3(0, 0, 0.3 * std::sin(phase)));
    rig.device.sample.X_DH = {p, q};
    rig.run(1);
    if (i > 0) {
      const auto work_of = [&](const Wrench& wrench) {
        return wrench.f.dot(p - last_p) + wrench.t.dot(rotation_vector(q * last_q.conjugate()));
      };
      const double work_j = work_of(held);
      asked_to_hand_j += std::max(0.0, work_of(asked));
      (work_j > 0 ? to_hand_j : from_hand_j) += std::abs(work_j);
    }
    last_p = p;
    last_q = q;
    held = rig.core.record().displayed_on_hand_D;
    asked = rig.core.record().stage_wrench_on_hand_D * rig.core.record().passivity_gain;
  }
  EXPECT_GT(to_hand_j, 0.01);
  EXPECT_NEAR(rig.core.counters().energy_to_hand_j, to_hand_j, kSumRounding);
  EXPECT_NEAR(rig.core.counters().energy_from_hand_j, from_hand_j, kSumRounding);
  // The server is told of what was asked for before the ramp, and four times as much: hand joules are world joules
  // · s_f / s_p.
  EXPECT_GT(asked_to_hand_j, 1.02 * to_hand_j);
  EXPECT_NEAR(rig.sent().energy_to_hand_j, 4 * asked_to_hand_j, 4 * kSumRounding);
}

TEST(HapticCore, TheServerGetsTheEnergyAlsoOfAForceThatTheDeviceCannotShow) {
  Rig rig("hold");
  rig.enter_scene();
  rig.run(700);
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, -100);
  rig.run(50);
  const double told_before_j = rig.sent().energy_from_hand_j;
  const double displayed_before_j = rig.core.counters().energy_from_hand_j;
  for (int i = 0; i < 100; ++i) {
    rig.device.sample.X_DH.p.z() += 1e-5;
    rig.run(1);
  }
  EXPECT_NEAR(rig.sent().energy_from_hand_j - told_before_j, 100 * 1e-3, 2e-3);
  EXPECT_LT(rig.core.counters().energy_from_hand_j - displayed_before_j, 20 * 1e-3) << "no device here shows 100 N";
}

TEST(HapticCore, WhileTheClutchIsDownNoEnergyIsReported) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, -3);
  rig.run(700);
  rig.device.sample.buttons = kButtonClutch;
  rig.run(1);
  const auto net_j = [&rig] {
    const proto::ClientUpdate& told = rig.sent();
    return told.energy_from_hand_j - told.energy_to_hand_j;
  };
  const double before_j = net_j();
  for (int i = 0; i < 1000; ++i) {
    rig.device.sample.X_DH.p.z() += 1e-4;
    rig.run(1);
  }
  EXPECT_EQ(net_j(), before_j);
  rig.device.sample.buttons = 0;
  rig.run(2);
  EXPECT_EQ(net_j(), before_j) << "nor for what it moved meanwhile";
}

TEST(HapticCore, WhoDrivesWithoutBeingShownReportsTheEnergyOfWhatTheServerWouldShow) {
  Rig rig("late-pose");
  rig.enter_scene();
  rig.scene.may_display = false;
  rig.mailboxes.scene.publish(rig.scene);
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, -3);
  rig.run(100);
  const double before_j = rig.sent().energy_from_hand_j;
  for (int i = 0; i < 100; ++i) {
    rig.device.sample.X_DH.p.z() += 1e-4;
    rig.run(1);
  }
  EXPECT_NEAR(rig.sent().energy_from_hand_j - before_j, 3 * 0.01, 1e-3);
  EXPECT_EQ(rig.force(), Vec3::Zero());
}

TEST(HapticCore, AnAbsurdWrenchDoesNotMakeAnAbsurdSum) {
  Rig rig("hold");
  rig.enter_scene();
  rig.run(700);
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, -1e15);
  rig.run(1);
  rig.device.sample.X_DH.p.z() += 1e-3;
  rig.run(1);
  EXPECT_LE(rig.sent().energy_from_hand_j, 1.01);
}

TEST(HapticCore, UpdateForTheServerSaysWhatThisTickSaw) {
  Rig rig;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.003, 0, 0);
  rig.device.sample.buttons = kButtonGrab;
  rig.received.update.sent = ServerTime(std::chrono::milliseconds(77));
  rig.run(10);
  const proto::ClientUpdate& sent = rig.sent();
  EXPECT_EQ(sent.input_tick.value, 10U);
  EXPECT_EQ(sent.handle.X.p, Vec3(0.003, 0, 0));
  EXPECT_TRUE(sent.handle_valid);
  EXPECT_EQ(sent.buttons, kButtonGrab);
  EXPECT_EQ(sent.acknowledged_step.value, 10U);
  EXPECT_EQ(sent.acknowledged_sent, rig.received.update.sent);
  EXPECT_EQ(sent.acknowledged_held, kTick);
  EXPECT_EQ(sent.sent, rig.now);
}

TEST(HapticCore, LostHandIsZeroForceAndToldToTheServer) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.device.sample.X_DH.p.x() = std::numeric_limits<double>::quiet_NaN();  // claims to be valid
  rig.run(20);
  EXPECT_TRUE(rig.force().isZero(0));
  EXPECT_FALSE(rig.sent().handle_valid);
  EXPECT_EQ(rig.core.counters().invalid_samples, 20U);
}

TEST(HapticCore, OnlyADeviceThatIsReadyIsGivenAForceAndDrives) {
  for (const auto state :
       {devices::DeviceState::kOpening, devices::DeviceState::kHoming, devices::DeviceState::kLost}) {
    SCOPED_TRACE(devices::name_of(state));
    Rig rig;
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
    rig.run(700);
    ASSERT_NEAR(rig.force().x(), -1.5, 1e-9);
    rig.device.sample.state = state;  // though the driver still calls its poses valid
    rig.run(1);
    EXPECT_TRUE(rig.device.last.f.isZero(0)) << "at once, for nobody knows what such a device does with a force";
    rig.run(500);
    EXPECT_TRUE(rig.device.last.f.isZero(0));
    EXPECT_FALSE(rig.sent().handle_valid);
    rig.device.sample.state = devices::DeviceState::kReady;
    rig.run(250);
    EXPECT_GT(rig.device.last.f.norm(), 0.1) << "and comes back";
    EXPECT_LT(rig.device.last.f.norm(), 1.4) << "by the ramp";
  }
}

TEST(HapticCore, AButtonThatTheDeviceDoesNotHaveIsNoise) {
  Rig rig;
  rig.enter_scene();
  rig.device.sample.buttons = kButtonGrab | 1U << 7U;
  rig.run(2);
  EXPECT_EQ(rig.sent().buttons, kButtonGrab);
}

TEST(HapticCore, JumpOfThePositionIsAFaultEvenIfTheDeviceReportsNoSpeed) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.device.sample.X_DH.p.x() += 0.0031;  // 3.1 m/s
  rig.run(1);
  EXPECT_TRUE(rig.core.record().safety_faults & haptics::kSafetyTooFast);
  int ticks = 1;
  for (; !rig.force().isZero(0) && ticks <= 20; ++ticks) rig.run(1);
  EXPECT_LE(ticks, 20);
}

TEST(HapticCore, NotANumberFromTheServerNeverReachesTheDevice) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.received.update.wrench_on_hand_W.f.x() = std::numeric_limits<double>::quiet_NaN();
  rig.run(50);
  EXPECT_TRUE(rig.force().isZero(0));
  EXPECT_EQ(rig.core.counters().not_finite_ticks, 50U);
  EXPECT_TRUE(rig.device.all_finite);
}

TEST(HapticCore, ShutdownIsQuietAndEndsWithAZeroCommand) {
  Rig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.core.begin_shutdown();
  int ticks = 0;
  while (!rig.core.is_quiet() && ticks < 100) {
    rig.run(1);
    ++ticks;
  }
  EXPECT_LE(ticks, 20);
  rig.core.write_zero(rig.now);
  EXPECT_TRUE(rig.device.last.f.isZero(0));
}

TEST(HapticCore, WatchedBodyIsFoundAndSurvivesThinnedUpdates) {
  Rig rig;
  rig.core.watch(BodyId{7});
  rig.enter_scene();
  rig.run(1);
  EXPECT_FALSE(rig.core.record().has_watched_body);
  proto::BodyState body;
  body.id = BodyId{7};
  body.state.X.p = Vec3(1, 2, 3);
  rig.received.update.bodies.push_back(body);
  rig.run(1);
  EXPECT_TRUE(rig.core.record().has_watched_body);
  rig.received.update.bodies.clear();
  rig.run(1);
  EXPECT_TRUE(rig.core.record().has_watched_body);
  EXPECT_EQ(rig.core.record().watched_body_W.X.p, Vec3(1, 2, 3));
}

/// What a hand gets that moves along a force of the server which answers it 100 ms late.
double energy_taken_j(bool is_passivity_controlled) {
  ScriptedDevice device;
  ClientMailboxes mailboxes;
  HapticCore core({.stage = {.name = "hold", .passivity = is_passivity_controlled}}, device, mailboxes);
  HapticScene scene;
  scene.generation = 1;
  scene.may_drive = scene.may_display = true;
  mailboxes.scene.publish(scene);
  ReceivedUpdate received;
  LocalTime now{std::chrono::seconds(1)};
  double x = 0, v = 0;
  std::vector<double> places;
  for (int k = 0; k < 6000; ++k) {
    now += kTick;
    places.push_back(x);
    ++received.update.step.value;
    received.received = now;
    received.update.wrench_on_hand_W.f.x() = k < 100 ? 0.0 : -300 * places[static_cast<std::size_t>(k - 100)];
    mailboxes.inbox.publish(received);
    device.sample.X_DH.p.x() = x;
    device.sample.V_DH.v.x() = v;
    device.sample.taken = now;
    core.tick(now);
    // A hand of 0.3 kg, hardly held.
    v += (core.record().displayed_on_hand_D.f.x() + 20 * (0.005 - x)) / 0.3 * 0.001;
    x += v * 0.001;
  }
  return core.counters().energy_to_hand_j - core.counters().energy_from_hand_j;
}

TEST(HapticCore, WithThePassivityControllerALateForceGivesTheHandNoEnergy) {
  EXPECT_GT(energy_taken_j(false), 5e-3);
  // Beside the initial credit what the ramp at the start left out.
  EXPECT_LT(energy_taken_j(true), 1e-3);
}

/// A hand of 0.3 kg on 200 N/m that presses a wall of 5 kN/m through a massless tool of a server, `delay` each way, and
/// leaves it, four times.
struct PressedWall {
  void run(int ticks) {
    scene.generation = 1;
    scene.law = law_index("spring-damper");
    scene.may_drive = scene.may_display = true;
    mailboxes.scene.publish(scene);
    for (k = 0; k < ticks; ++k) tick();
  }
  void tick() {
    now += kTick;
    handles.emplace_back(x, v, 0);
    if (k >= delay) step(handles[static_cast<std::size_t>(k - delay)]);
    told.push_back(server);
    if (k >= 2 * delay) {
      received.update = told[static_cast<std::size_t>(k - delay)];
      received.received = now;
      mailboxes.inbox.publish(received);
    }
    device.sample.X_DH.p.x() = x;
    device.sample.V_DH.v.x() = v;
    device.sample.taken = now;
    core.tick(now);
    const double intended = k / 1000 % 2 == 1 ? 0.012 : -0.005;
    v += (core.record().displayed_on_hand_D.f.x() + 200 * (intended - x) - 6 * v) / 0.3 * 0.001;
    x += v * 0.001;
  }
  void step(const Vec3& handle) {
    const double k_c = scene.coupling.stiffness_n_per_m, b_c = scene.coupling.damping_n_s_per_m;
    const double before = server.tool.X.p.x();
    const double pull = k_c * handle.x() + b_c * handle.y() + b_c * 1e3 * before;
    double next = pull / (k_c + b_c * 1e3);
    if (next > 0) next = pull / (k_c + b_c * 1e3 + 5000);
    const double on_tool = k_c * (handle.x() - next) + b_c * (handle.y() - (next - before) * 1e3);
    const double work_j = on_tool * (next - before);
    server.energy_into_world_j += std::max(0.0, work_j);
    server.energy_from_world_j += std::max(0.0, -work_j);
    server.tool.X.p.x() = next;
    server.tool.V.v.x() = (next - before) * 1e3;
    server.wrench_on_hand_W.f.x() = -on_tool;
    ++server.step.value;
  }

  explicit PressedWall(int delay_ticks) : delay(delay_ticks) {}
  int delay, k = 0;
  ScriptedDevice device;
  ClientMailboxes mailboxes;
  HapticScene scene;
  ReceivedUpdate received;
  proto::ServerUpdate server;
  LocalTime now{std::chrono::seconds(1)};
  double x = -0.005, v = 0;
  std::vector<Vec3> handles;
  std::vector<proto::ServerUpdate> told;
  HapticCore core{{.stage = {.name = "late-pose"}}, device, mailboxes};
};

TEST(HapticCore, ThePassivityControllerLeavesAHandThatPressesAWallAlone) {
  for (const int delay : {0, 15, 50}) {
    PressedWall wall(delay);
    wall.run(8000);
    const HapticCounters& counters = wall.core.counters();
    const double exchanged_j = counters.energy_to_hand_j + counters.energy_from_hand_j;
    EXPECT_GT(exchanged_j, 0.01) << delay << " ms";
    EXPECT_LE(counters.passivity_withheld_j, 0.01 * exchanged_j)
        << delay << " ms: " << counters.passivity_limited_ticks << " ticks, " << counters.passivity_withheld_j
        << " J of " << exchanged_j;
  }
}

TEST(HapticCore, WhatThePassivityControllerWithheldIsRecordedAndCounted) {
  ScriptedDevice device;
  ClientMailboxes mailboxes;
  HapticCore core({.stage = {.name = "hold"}}, device, mailboxes);
  HapticScene scene;
  scene.generation = 1;
  scene.may_drive = scene.may_display = true;
  mailboxes.scene.publish(scene);
  ReceivedUpdate received;
  received.update.wrench_on_hand_W.f.x() = 3;
  LocalTime now{std::chrono::seconds(1)};
  for (int k = 0; k < 2000; ++k) {
    now += kTick;
    received.received = now;
    mailboxes.inbox.publish(received);
    device.sample.X_DH.p.x() += 1e-4;  // with the force
    core.tick(now);
  }
  EXPECT_EQ(core.record().stage_wrench_on_hand_D.f.x(), 3) << "before the passivity controller";
  EXPECT_LT(core.record().passivity_gain, 0.1);
  EXPECT_NEAR(core.counters().passivity_withheld_j, 3 * 0.2, 0.01) << "nearly all of it";
  EXPECT_GT(core.counters().passivity_limited_ticks, 1900U);
  EXPECT_LE(core.counters().energy_to_hand_j, haptics::HandPassivityController::kInitialCredit_j + 1e-9);
}

TEST(HapticCore, WhatTheServerDrewFromTheWorldMayReachTheHand) {
  ScriptedDevice device;
  ClientMailboxes mailboxes;
  HapticCore core({.stage = {.name = "hold"}}, device, mailboxes);
  HapticScene scene;
  scene.generation = 1;
  scene.may_drive = scene.may_display = true;
  scene.workspace.position_scale = 2;
  scene.workspace.force_scale = 0.5;
  mailboxes.scene.publish(scene);
  ReceivedUpdate received;
  received.update.wrench_on_hand_W.f.x() = 3;
  LocalTime now{std::chrono::seconds(1)};
  for (int k = 0; k < 2000; ++k) {
    now += kTick;
    received.received = now;
    received.update.energy_from_world_j += 3 * 2 * 1e-4;
    mailboxes.inbox.publish(received);
    device.sample.X_DH.p.x() += 1e-4;
    core.tick(now);
  }
  EXPECT_EQ(core.record().passivity_gain, 1);
  EXPECT_NEAR(core.record().displayed_on_hand_D.f.x(), 1.5, 1e-9);
}

TEST(HapticCore, TheWaveStageSpeaksToTheServerAndKeepsItsWordThroughAMissedSample) {
  Rig rig("wave");
  rig.enter_scene();
  rig.run(10);
  for (int k = 0; k < 100; ++k) {
    rig.device.sample.X_DH.p.x() += 1e-4;
    rig.run(1);
  }
  const proto::ClientUpdate moving = rig.sent();
  EXPECT_EQ(moving.mode, proto::ClientMode::kWave);
  EXPECT_GT(moving.wave.f.x(), 0);
  rig.device.sample.is_valid = false;
  rig.run(1);
  const proto::ClientUpdate blind = rig.sent();
  EXPECT_FALSE(blind.handle_valid);
  EXPECT_EQ(blind.mode, proto::ClientMode::kWave);
  EXPECT_EQ(blind.wave.f, moving.wave.f);
}

TEST(HapticCore, TellsTheRoundTripOfTheNewestExchange) {
  Rig rig;
  rig.enter_scene();
  rig.run(5);
  rig.received.update.echoed_sent = rig.now - std::chrono::milliseconds(40);
  rig.received.update.received = ServerTime(std::chrono::hours(1));
  rig.received.update.sent = ServerTime(std::chrono::hours(1) + std::chrono::milliseconds(3));
  rig.run(1);
  EXPECT_EQ(rig.sent().round_trip, std::chrono::milliseconds(37));
}

TEST(HapticCore, UnknownStageIsRefusedWithTheNamesThatExist) {
  ScriptedDevice device;
  ClientMailboxes mailboxes;
  try {
    HapticCore core({.stage = {.name = "telepathy"}}, device, mailboxes);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::strstr(error.what(), "telepathy"), nullptr);
    EXPECT_NE(std::strstr(error.what(), "late-pose"), nullptr);
  }
}

TEST(HapticCore, UnknownPredictorIsRefusedWithTheNamesThatExist) {
  ScriptedDevice device;
  ClientMailboxes mailboxes;
  try {
    HapticCore core({.stage = {.predictor = "telepathy"}}, device, mailboxes);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::strstr(error.what(), "telepathy"), nullptr);
    EXPECT_NE(std::strstr(error.what(), "ar-spline"), nullptr);
  }
}

}  // namespace
}  // namespace tandem::client
