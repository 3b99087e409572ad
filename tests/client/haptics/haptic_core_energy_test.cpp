// Tests the energy at the hand's port through the whole tick: the work of the displayed and of the requested wrench,
// and the passivity controller.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/client/haptics/haptic_rig.hpp"

namespace tandem::client {
namespace {

// Bound of the rounding error of a sum of a few thousand products of order 1.
constexpr double kSumRounding = 1e-10;

TEST(HapticCore, EnergyIsTheSumOfForceTimesTheMotionThatFollowed) {
  HapticRig rig("hold");
  rig.scene.workspace.position_scale = 4;
  rig.enter_scene();
  double to_hand_j = 0;
  double from_hand_j = 0;
  double requested_to_hand_j = 0;
  Vec3 last_p = Vec3::Zero();
  Quat last_q = Quat::Identity();
  Wrench held, requested;
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
      requested_to_hand_j += std::max(0.0, work_of(requested));
      (work_j > 0 ? to_hand_j : from_hand_j) += std::abs(work_j);
    }
    last_p = p;
    last_q = q;
    held = rig.core.record().displayed_on_hand_D;
    requested = rig.core.record().stage_wrench_on_hand_D * rig.core.record().passivity_gain;
  }
  EXPECT_GT(to_hand_j, 0.01);
  EXPECT_NEAR(rig.core.counters().energy_to_hand_j, to_hand_j, kSumRounding);
  EXPECT_NEAR(rig.core.counters().energy_from_hand_j, from_hand_j, kSumRounding);
  // The client sends the work of the requested wrench (before the start ramp), not that of the displayed wrench. It is
  // in units of the world: work at the hand times s_p / s_f (position scale, force scale), here 4.
  EXPECT_GT(requested_to_hand_j, 1.02 * to_hand_j);
  EXPECT_NEAR(rig.sent().energy_to_hand_j, 4 * requested_to_hand_j, 4 * kSumRounding);
}

TEST(HapticCore, TheServerGetsTheEnergyAlsoOfAForceThatTheDeviceCannotShow) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.run(700);
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, -100);
  rig.run(50);
  const double sent_before_j = rig.sent().energy_from_hand_j;
  const double displayed_before_j = rig.core.counters().energy_from_hand_j;
  for (int i = 0; i < 100; ++i) {
    rig.device.sample.X_DH.p.z() += 1e-5;
    rig.run(1);
  }
  EXPECT_NEAR(rig.sent().energy_from_hand_j - sent_before_j, 100 * 1e-3, 2e-3);
  EXPECT_LT(rig.core.counters().energy_from_hand_j - displayed_before_j, 20 * 1e-3) << "no device here shows 100 N";
}

TEST(HapticCore, WhileTheClutchIsDownNoEnergyIsReported) {
  HapticRig rig("hold");
  rig.enter_scene();
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, -3);
  rig.run(700);
  rig.device.sample.buttons = kButtonClutch;
  rig.run(1);
  const auto net_j = [&rig] {
    const proto::ClientUpdate& sent = rig.sent();
    return sent.energy_from_hand_j - sent.energy_to_hand_j;
  };
  const double before_j = net_j();
  for (int i = 0; i < 1000; ++i) {
    rig.device.sample.X_DH.p.z() += 1e-4;
    rig.run(1);
  }
  EXPECT_EQ(net_j(), before_j);
  rig.device.sample.buttons = 0;
  rig.run(2);
  EXPECT_EQ(net_j(), before_j) << "motion while clutched must not count";
}

TEST(HapticCore, WhoDrivesWithoutBeingShownReportsTheEnergyOfWhatTheServerWouldShow) {
  HapticRig rig("late-pose");
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
  HapticRig rig("hold");
  rig.enter_scene();
  rig.run(700);
  rig.received.update.wrench_on_hand_W.f = Vec3(0, 0, -1e15);
  rig.run(1);
  rig.device.sample.X_DH.p.z() += 1e-3;
  rig.run(1);
  EXPECT_LE(rig.sent().energy_from_hand_j, 1.01);
}

/// Returns the energy that a hand gains from a server force that responds to its motion with a delay of 100 ms.
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
    // Mechanics of the simulated hand: 0.3 kg with a weak grip of 20 N/m.
    v += (core.record().displayed_on_hand_D.f.x() + 20 * (0.005 - x)) / 0.3 * 0.001;
    x += v * 0.001;
  }
  return core.counters().energy_to_hand_j - core.counters().energy_from_hand_j;
}

TEST(HapticCore, WithThePassivityControllerALateForceGivesTheHandNoEnergy) {
  EXPECT_GT(energy_taken_j(false), 30e-3);
  // Bound: 1 mJ, plus the leak of the controller in 6 s. The 1 mJ covers the initial credit and the energy that the
  // start ramp withheld.
  EXPECT_LT(energy_taken_j(true), 1e-3 + 6 * haptics::HandPassivityController::kLeakRate_w);
}

/// A hand of 0.3 kg with a stiffness of 200 N/m presses a wall of 5 kN/m and leaves it, four times. The server
/// simulates the wall and a tool without mass, with a delay of `delay` ticks in each direction.
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
    sent_updates.push_back(server);
    if (k >= 2 * delay) {
      received.update = sent_updates[static_cast<std::size_t>(k - delay)];
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
  std::vector<proto::ServerUpdate> sent_updates;
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

TEST(HapticCore, EnergyWithheldByThePassivityControllerIsRecordedAndCounted) {
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
    device.sample.X_DH.p.x() += 1e-4;  // the hand moves along the force
    core.tick(now);
  }
  EXPECT_EQ(core.record().stage_wrench_on_hand_D.f.x(), 3) << "before the passivity controller";
  EXPECT_LT(core.record().passivity_gain, 0.1);
  EXPECT_NEAR(core.counters().passivity_withheld_j, 3 * 0.2, 0.02) << "nearly all of it";
  EXPECT_GT(core.counters().passivity_limited_ticks, 1900U);
  using Controller = haptics::HandPassivityController;
  EXPECT_LE(core.counters().energy_to_hand_j, Controller::kInitialCredit_j + 2 * Controller::kLeakRate_w + 1e-9);
}

TEST(HapticCore, EnergyFromTheWorldMayReachTheHand) {
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

}  // namespace
}  // namespace tandem::client
