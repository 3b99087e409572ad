// Tests the loop on its real-time thread. The tests check order and counts only, so that they do not depend on the
// speed of the machine.
#include "client/haptics/haptic_loop.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/client/haptics/scripted_device.hpp"

namespace tandem::client {
namespace {

constexpr HapticLoopSettings kNormalPriority{};

struct Rig {
  explicit Rig(const HapticLoopSettings& settings = kNormalPriority)
      : core({.stage = {.name = "hold"}}, device, mailboxes), loop(settings, core, [this] { ++wake_ups; }) {}

  void wait_for_ticks(int n) const {
    while (wake_ups.load() < n) std::this_thread::yield();
  }

  void wait_until_over() const {
    while (!loop.is_over()) std::this_thread::yield();
  }
  void start_with_force() {
    HapticScene scene;
    scene.generation = 1;
    scene.may_drive = scene.may_display = true;
    mailboxes.scene.publish(scene);
    ReceivedUpdate state;
    state.update.wrench_on_hand_W.f = Vec3(0, 0, 2);
    // A reception time one hour ahead, so that the state never becomes stale in these tests.
    state.received = SteadyClock().now() + std::chrono::hours(1);
    loop.start();
    wait_for_ticks(5);  // a state is accepted only after the loop has adopted the scene
    mailboxes.inbox.publish(state);
  }

  ScriptedDevice device;
  ClientMailboxes mailboxes;
  HapticCore core;
  std::atomic<int> wake_ups{0};
  HapticLoop loop;
};

TEST(HapticLoop, EveryTickIsTracedInOrderAndWakesTheIoThread) {
  Rig rig;
  EXPECT_TRUE(rig.loop.start().empty()) << "no real-time right was requested";
  rig.wait_for_ticks(50);
  rig.loop.stop();
  TickRecord record;
  std::uint64_t ticks = 0;
  LocalTime last{};
  while (rig.loop.pop(record)) {
    EXPECT_EQ(record.tick.value, ++ticks);
    EXPECT_GT(record.at, last);
    last = record.at;
  }
  EXPECT_EQ(ticks, rig.loop.report().ticks_run);
  EXPECT_EQ(ticks, static_cast<std::uint64_t>(rig.wake_ups.load()));
  EXPECT_EQ(rig.loop.trace_overflows(), 0U);
}

TEST(HapticLoop, DeadlinesAreEitherRunOrMissed) {
  Rig rig;
  rig.loop.start();
  rig.wait_for_ticks(50);
  rig.loop.stop();
  const HapticLoopReport& report = rig.loop.report();
  EXPECT_EQ(report.ticks_expected, report.ticks_run + report.missed);
  EXPECT_EQ(report.lateness.count(), report.ticks_run);
  EXPECT_EQ(report.throttle_suspects, 0U) << "not counted at normal priority";
}

TEST(HapticLoop, KeepsItsProcessorAwakeOnlyIfRequestedAndWithAPriority) {
  for (const bool is_stated : {true, false}) {
    HapticLoopSettings settings = kNormalPriority;
    if (is_stated) settings.keeps_awake = true;
    Rig rig(settings);
    rig.loop.start();
    EXPECT_EQ(rig.loop.keeps_awake(), is_stated);
    rig.wait_for_ticks(20);
    rig.loop.stop();
    EXPECT_EQ(rig.loop.report().keeps_awake, is_stated);
  }
}

TEST(HapticLoop, UnreadRecordsThatAreLostAreCounted) {
  HapticLoopSettings settings = kNormalPriority;
  settings.trace_capacity = 8;
  Rig rig(settings);
  rig.loop.start();
  rig.wait_for_ticks(50);
  rig.loop.stop();
  TickRecord record;
  std::uint64_t kept = 0;
  while (rig.loop.pop(record)) ++kept;
  EXPECT_EQ(kept, 8U);
  EXPECT_EQ(kept + rig.loop.trace_overflows(), rig.loop.report().ticks_run);
}

TEST(HapticLoop, StopWritesZeroLast) {
  Rig rig;
  rig.start_with_force();
  rig.wait_for_ticks(100);
  rig.loop.stop();
  EXPECT_GT(rig.core.counters().force_max_n, 0) << "there was a force to end";
  EXPECT_TRUE(rig.device.last.f.isZero(0));
  EXPECT_TRUE(rig.core.is_quiet());
}

TEST(HapticLoop, ARequestedStopDisplaysZeroWithoutReadersOrAJoin) {
  Rig rig;
  rig.start_with_force();
  rig.wait_for_ticks(100);
  EXPECT_FALSE(rig.loop.is_over());
  rig.loop.request_stop();
  rig.wait_until_over();
  EXPECT_GT(rig.core.counters().force_max_n, 0) << "there was a force to end";
  EXPECT_TRUE(rig.device.last.f.isZero(0));
  EXPECT_TRUE(rig.loop.report().became_quiet);
}

TEST(HapticLoop, EndsByItselfWhenItsDurationIsOver) {
  HapticLoopSettings settings = kNormalPriority;
  settings.duration = std::chrono::milliseconds(150);
  Rig rig(settings);
  rig.start_with_force();
  rig.wait_until_over();
  EXPECT_TRUE(rig.device.last.f.isZero(0));
  const HapticLoopReport& report = rig.loop.report();
  EXPECT_GE(report.ticks_expected, 150U);
  EXPECT_EQ(report.ticks_expected, report.ticks_run + report.missed);
}

TEST(HapticLoop, RepeatsTheLastZeroUntilTheDeviceAcceptsIt) {
  Rig rig;
  rig.start_with_force();
  rig.wait_for_ticks(100);
  rig.device.accepts = false;
  rig.loop.request_stop();
  while (rig.device.refused < 5) std::this_thread::yield();
  rig.device.accepts = true;
  rig.wait_until_over();
  EXPECT_TRUE(rig.device.last.f.isZero(0));
}

TEST(HapticLoop, ReportsThatTheDeviceDidNotAcceptZero) {
  Rig rig;
  // The device refuses commands only after it has accepted a nonzero force. If it refused from a fixed tick on, its
  // last accepted force could be zero by chance, and the loop would rightly report success.
  rig.device.keeps_force = true;
  rig.start_with_force();
  while (rig.device.refused == 0) std::this_thread::yield();
  rig.loop.stop();
  EXPECT_FALSE(rig.loop.report().became_quiet);
  EXPECT_FALSE(rig.device.last.f.isZero(0)) << "and that is so";
}

TEST(HapticLoop, StopTwiceAndStopWithoutStartDoNoHarm) {
  Rig never_started;
  never_started.loop.stop();
  Rig rig;
  rig.loop.start();
  rig.loop.stop();
  rig.loop.stop();
  EXPECT_GE(rig.loop.report().ticks_run, 1U);
}

}  // namespace
}  // namespace tandem::client
