// Tests the whole tick: the displayed force, the conditions under which it must be zero, and the update for the server.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <stdexcept>

#include "tests/client/haptics/haptic_rig.hpp"

namespace tandem::client {
namespace {

TEST(HapticCore, DisplaysNothingBeforeAScene) {
  HapticRig rig;
  rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
  rig.run(1000);
  EXPECT_EQ(rig.core.counters().force_max_n, 0);
  EXPECT_FALSE(rig.sent().handle_valid);
}

TEST(HapticCore, DisplaysNothingToAnObserver) {
  HapticRig rig;
  rig.enter_scene();
  rig.scene.may_drive = rig.scene.may_display = false;
  rig.mailboxes.scene.publish(rig.scene);
  rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
  rig.run(1000);
  EXPECT_EQ(rig.core.counters().force_max_n, 0);
}

TEST(HapticCore, AnObserverThatGetsStatesIsNotSilent) {
  HapticRig rig;
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
  HapticRig rig("hold");
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

TEST(HapticCore, AUserWithoutForceStillDrivesToolAndButtons) {
  HapticRig rig;
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

TEST(HapticCore, HoldShowsTheServersWrench) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W = {Vec3(0, 0, 2), Vec3(0, 0.05, 0)};
  rig.run(700);
  EXPECT_LT((rig.force() - Vec3(0, 0, 2)).norm(), 1e-9);
  EXPECT_LT((rig.core.record().displayed_on_hand_D.t - Vec3(0, 0.05, 0)).norm(), 1e-9);
}

TEST(HapticCore, SilentServerMeansZeroForceWithin150MillisecondsOfTheLastArrival) {
  HapticRig rig("hold");
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

// The server's simulation stops, but its messages continue: sequence number and sending time advance, the step time
// does not. The client must treat this as a silence.
TEST(HapticCore, AServerStepThatDoesNotAdvanceCountsAsSilence) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = {0, 0, 2};
  const auto receive = [&](Duration stood_still) {
    rig.received.update.sent = ServerTime(rig.now.time_since_epoch());
    rig.received.update.stepped = rig.received.update.sent - stood_still;
    rig.receive();
    rig.tick();
  };
  for (int k = 0; k < 700; ++k) receive(Duration{0});
  ASSERT_NEAR(rig.force().z(), 2, 1e-9);
  for (int k = 1; k <= 150; ++k) receive(std::chrono::milliseconds(k));
  EXPECT_EQ(rig.force().norm(), 0);
  EXPECT_TRUE(rig.core.record().safety_faults & haptics::kSafetySilence);
}

TEST(HapticCore, NewSceneForgetsTheOldStateAndRampsAgain) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.receive();      // a state of the previous connection arrives
  rig.enter_scene();  // the next scene arrives before the next tick of the client
  for (int i = 0; i < 50; ++i) rig.tick();
  EXPECT_TRUE(rig.force().isZero(0)) << "no state of the new scene has come";
  EXPECT_LT(rig.core.record().state_age, Duration{0});
  rig.run(100);
  EXPECT_GT(rig.force().z(), 0.3);
  EXPECT_LT(rig.force().z(), 0.41) << "2 N · 0.1 s / 0.5 s";
}

TEST(HapticCore, ButtonsOfAnOldSceneAreNotSentToANewOne) {
  HapticRig rig;
  rig.enter_scene();
  rig.device.sample.buttons = kButtonGrab;
  rig.run(10);
  rig.device.sample.is_valid = false;
  rig.enter_scene();
  rig.run(1);
  EXPECT_EQ(rig.sent().buttons, 0U);
}

TEST(HapticCore, RefusedWriteIsCountedAndTheForceComesBackByTheRamp) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.device.accepts = false;
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 3);
  rig.run(300);
  EXPECT_EQ(rig.core.counters().write_failures, 300U);
  EXPECT_EQ(rig.force(), Vec3(0, 0, 2)) << "the last force that the device accepted";
  EXPECT_FALSE(rig.core.is_quiet());
  rig.device.accepts = true;
  rig.run(1);
  EXPECT_TRUE(rig.device.last.f.isZero(0)) << "the first accepted force must be zero";
  rig.run(250);
  EXPECT_NEAR(rig.force().z(), 1.5, 0.02) << "3 N · 0.25 s / 0.5 s";
}

TEST(HapticCore, SingleRefusedWriteIsPlayedOutToZeroBeforeTheRamp) {
  HapticRig rig("hold");
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
  HapticRig rig("hold");
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

TEST(HapticCore, UpdateForTheServerContainsTheHandOfThisTick) {
  HapticRig rig;
  rig.enter_scene();
  rig.device.sample.X_DH.p = Vec3(0.003, 0, 0);
  rig.device.sample.buttons = kButtonGrab;
  rig.run(10);
  const proto::ClientUpdate& sent = rig.sent();
  EXPECT_EQ(sent.input_tick.value, 10U);
  EXPECT_EQ(sent.handle.X.p, Vec3(0.003, 0, 0));
  EXPECT_TRUE(sent.handle_valid);
  EXPECT_EQ(sent.buttons, kButtonGrab);
}

TEST(HapticCore, LostHandIsZeroForceAndReportedToTheServer) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.device.sample.X_DH.p.x() = std::numeric_limits<double>::quiet_NaN();  // NaN in a sample that is flagged as valid
  rig.run(20);
  EXPECT_TRUE(rig.force().isZero(0));
  EXPECT_FALSE(rig.sent().handle_valid);
  EXPECT_EQ(rig.core.counters().invalid_samples, 20U);
}

TEST(HapticCore, ASampleThatNoHandCanHaveGivenLetsTheForceGoAndIsExplained) {
  struct Case {
    const char* expected;
    std::function<void(ScriptedDevice&)> spoil;
  };
  const Case cases[] = {
      {"time stamp", [](ScriptedDevice& device) { device.has_frozen_clock = true; }},
      {"orientation", [](ScriptedDevice& device) { device.sample.X_DH.q.coeffs().setZero(); }},
      {"outside of the device's workspace", [](ScriptedDevice& device) { device.sample.X_DH.p = Vec3(1e12, 0, 0); }},
      {"faster than any hand", [](ScriptedDevice& device) { device.sample.V_DH.w = Vec3(0, 1e6, 0); }},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.expected);
    HapticRig rig("hold");
    rig.enter_scene();
    rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
    rig.run(700);
    ASSERT_EQ(rig.device.last.f.z(), 2);
    const devices::DeviceSample good = rig.device.sample;
    one.spoil(rig.device);
    rig.run(45);  // 20 ms until the time stamp is too old, and 20 ms until the force is zero
    EXPECT_TRUE(rig.device.last.f.isZero(0));
    EXPECT_FALSE(rig.sent().handle_valid);
    EXPECT_NE(describe(rig.core.record().sample).find(one.expected), std::string::npos)
        << describe(rig.core.record().sample);
    rig.run(1000);
    EXPECT_TRUE(rig.device.last.f.isZero(0)) << "as long as it lasts";
    rig.device.sample = good;
    rig.device.has_frozen_clock = false;
    rig.run(252);
    EXPECT_NEAR(rig.device.last.f.z(), 1, 0.02) << "the force returns with the ramp of 0.5 s";
    EXPECT_TRUE(rig.core.record().sample.reason.empty());
  }
}

TEST(HapticCore, OnlyADeviceThatIsReadyIsGivenAForceAndDrives) {
  for (const auto state :
       {devices::DeviceState::kOpening, devices::DeviceState::kHoming, devices::DeviceState::kLost}) {
    SCOPED_TRACE(devices::name_of(state));
    HapticRig rig;
    rig.enter_scene();
    rig.device.sample.X_DH.p = Vec3(0.005, 0, 0);
    rig.run(700);
    ASSERT_NEAR(rig.force().x(), -1.5, 1e-9);
    rig.device.sample.state = state;  // the driver flags its poses as valid in this state too
    rig.run(1);
    EXPECT_TRUE(rig.device.last.f.isZero(0)) << "at once, because the effect of a force is undefined in this state";
    rig.run(500);
    EXPECT_TRUE(rig.device.last.f.isZero(0));
    EXPECT_FALSE(rig.sent().handle_valid);
    rig.device.sample.state = devices::DeviceState::kReady;
    rig.run(250);
    EXPECT_GT(rig.device.last.f.norm(), 0.1) << "the force must return";
    EXPECT_LT(rig.device.last.f.norm(), 1.4) << "by the ramp";
  }
}

TEST(HapticCore, AButtonThatTheDeviceDoesNotHaveIsNoise) {
  HapticRig rig;
  rig.enter_scene();
  rig.device.sample.buttons = kButtonGrab | 1U << 7U;
  rig.run(2);
  EXPECT_EQ(rig.sent().buttons, kButtonGrab);
}

TEST(HapticCore, JumpOfThePositionIsAFaultEvenIfTheDeviceReportsNoSpeed) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.run(700);
  rig.device.sample.X_DH.p.x() += 0.0031;  // a jump of 3.1 mm in one tick, i.e. 3.1 m/s
  rig.run(1);
  EXPECT_TRUE(rig.core.record().safety_faults & haptics::kSafetyTooFast);
  int ticks = 1;
  for (; !rig.force().isZero(0) && ticks <= 20; ++ticks) rig.run(1);
  EXPECT_LE(ticks, 20);
}

TEST(HapticCore, NotANumberFromTheServerNeverReachesTheDevice) {
  HapticRig rig("hold");
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
  HapticRig rig("hold");
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
  HapticRig rig;
  rig.core.watch(BodyId{7});
  rig.enter_scene();
  rig.run(1);
  EXPECT_FALSE(rig.core.record().watched_body_W);
  proto::BodyState body;
  body.id = BodyId{7};
  body.state.X.p = Vec3(1, 2, 3);
  rig.received.update.bodies.push_back(body);
  rig.run(1);
  EXPECT_TRUE(rig.core.record().watched_body_W);
  rig.received.update.bodies.clear();
  rig.run(1);
  ASSERT_TRUE(rig.core.record().watched_body_W);
  EXPECT_EQ(rig.core.record().watched_body_W->X.p, Vec3(1, 2, 3));
}

TEST(HapticCore, TheWaveStageSendsItsWaveAndRepeatsItAfterAMissedSample) {
  HapticRig rig("wave");
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

void show(HapticRig& rig, const std::string& stage) {
  auto rendering = std::make_unique<Rendering>();
  rendering->stage = make_stage({.name = stage});
  ASSERT_TRUE(rig.core.offer(rendering));
}

/// Returns the largest change of force between two ticks in the next 600 ms.
double largest_step_n(HapticRig& rig) {
  double largest_n = 0;
  for (int i = 0; i < 600; ++i) {
    const Vec3 before = rig.force();
    rig.run(1);
    largest_n = std::max(largest_n, (rig.force() - before).norm());
  }
  return largest_n;
}

TEST(HapticCore, AChangeOfTheStageMakesNoForceStep) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
  rig.device.sample.X_DH.p = Vec3(0.01, 0, 0);
  rig.run(700);
  ASSERT_NEAR(rig.force().z(), 2, 1e-9);
  show(rig, "late-pose");
  EXPECT_LE(largest_step_n(rig), 0.1);
  ASSERT_LT((rig.force() - Vec3(-3, 0, 0)).norm(), 0.02) << "300 N/m over 10 mm: the force of the new stage";
  show(rig, "hold");
  EXPECT_LE(largest_step_n(rig), 0.1);
  EXPECT_LT((rig.force() - Vec3(0, 0, 2)).norm(), 0.02);
}

TEST(HapticCore, ThePassivityControllerIsSwitchedWithoutAForceStep) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(2, 0, 0);
  rig.run(700);
  const auto move = [&rig](int ticks) {
    double largest_n = 0;
    for (int i = 0; i < ticks; ++i) {
      const Vec3 before = rig.force();
      rig.device.sample.X_DH.p.x() += 2e-5;
      rig.run(1);
      largest_n = std::max(largest_n, (rig.force() - before).norm());
    }
    return largest_n;
  };
  // The force acts along the hand's motion and supplies energy to the hand.
  move(100);
  ASSERT_NEAR(rig.force().x(), 2, 1e-6);
  rig.core.control_passivity(true);
  EXPECT_LE(move(1000), 0.1);
  EXPECT_LT(rig.force().x(), 1.5) << "it is withheld";
  rig.core.control_passivity(false);
  EXPECT_LE(move(1000), 0.1);
  EXPECT_NEAR(rig.force().x(), 2, 1e-6);
}

TEST(HapticCore, APlaceThatSomebodyPointsAtIsFeltThreeTimesAndGently) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.scene.shown_W = Vec3(5, 5, 5);
  rig.run(700);
  ASSERT_TRUE(rig.force().isZero(0)) << "of a time before this scene";
  ++rig.scene.places_shown;
  rig.scene.shown_W = rig.core.record().handle_W.X.p + Vec3(0, 0.3, 0);
  rig.mailboxes.scene.publish(rig.scene);
  int pushes = 0;
  Vec3 before = Vec3::Zero(), impulse = Vec3::Zero();
  double strongest_n = 0;
  for (int ms = 0; ms < 1000; ++ms) {
    rig.run(1);
    const Vec3 now = rig.force();
    if (before.isZero(0) && !now.isZero(0)) ++pushes;
    ASSERT_LT((now - before).norm(), 0.02) << ms;
    strongest_n = std::max(strongest_n, now.norm());
    impulse += 0.001 * now;
    before = now;
  }
  EXPECT_EQ(pushes, 3);
  EXPECT_TRUE(rig.force().isZero(0)) << "it is over";
  EXPECT_NEAR(strongest_n, std::min(0.3, 0.1 * rig.device.spec().force_limit_n), 1e-3);
  EXPECT_NEAR(impulse.y(), 3 * 0.5 * 0.08 * strongest_n, 1e-4);
  EXPECT_NEAR(impulse.x(), 0, 1e-12);
  rig.scene.may_display = false;
  ++rig.scene.places_shown;
  rig.mailboxes.scene.publish(rig.scene);
  rig.run(10);
  EXPECT_TRUE(rig.force().isZero(0)) << "an observer must not feel a nudge";
}

}  // namespace
}  // namespace tandem::client
