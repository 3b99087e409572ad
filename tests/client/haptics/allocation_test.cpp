// Tests that a haptic tick allocates no memory. An allocator may take a lock or cause a page fault.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "client/haptics/haptic_core.hpp"
#include "common/realtime/ring.hpp"
#include "tests/client/haptics/scripted_device.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::client {
namespace {

class HapticTickAllocation : public ::testing::TestWithParam<std::string_view> {};

TEST_P(HapticTickAllocation, IsNoneFromTheFirstTickToShutdown) {
  ScriptedDevice device;
  auto mailboxes = std::make_unique<ClientMailboxes>();
  HapticCore core({.stage = {.name = std::string(GetParam())}, .feeds_view = true}, device, *mailboxes);
  realtime::Ring<TickRecord> trace(16);
  TickRecord taken;
  auto received = std::make_unique<ReceivedUpdate>();
  received->update.bodies.resize(proto::kMaxBodies);
  received->update.users.resize(proto::kMaxUsers);
  HapticScene scene;
  scene.may_drive = scene.may_display = true;
  core.watch(BodyId{3});

  const std::uint64_t before = test::allocation_count();
  LocalTime now{std::chrono::seconds(1)};
  for (int i = 0; i < 2000; ++i) {
    now += std::chrono::milliseconds(1);
    if (i % 500 == 100) {
      ++scene.generation;
      mailboxes->scene.publish(scene);
    }
    if (i % 500 == 300) {
      scene.law = 1 - scene.law;
      mailboxes->scene.publish(scene);
    }
    if (i < 1500) {
      received->received = now;
      mailboxes->inbox.publish(*received);
    }
    device.sample.X_DH.p.x() = 0.005 * std::sin(0.01 * i);
    device.sample.is_valid = i % 700 != 0;
    device.sample.buttons = i % 300 < 50 ? kButtonClutch : 0U;
    if (i == 1900) core.begin_shutdown();
    core.tick(now);
    trace.push(core.record());
    trace.pop(taken);
  }
  core.write_zero(now);
  EXPECT_EQ(test::allocation_count() - before, 0U);
  EXPECT_GT(core.counters().ticks, 0U);
}

INSTANTIATE_TEST_SUITE_P(EveryStage, HapticTickAllocation, ::testing::ValuesIn(stage_names()), [](const auto& test) {
  std::string name(test.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(AllocationCounter, CountsEachAllocation) {
  const std::uint64_t before = test::allocation_count();
  const auto one = std::make_unique<int>(1);
  EXPECT_EQ(test::allocation_count() - before, 1U);
}

}  // namespace
}  // namespace tandem::client
