// Tests soft bodies that are stepped on a worker thread. The results must be bit-identical to those of stepping on the
// room's thread, and the room must never wait for the worker.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "tests/server/physics/soft_support.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::server {
namespace {

/// Returns all wrenches and node positions that a room reads during 20 soft steps with a moving tool. If `steps_aside`,
/// a worker thread makes the soft steps.
std::vector<double> story(bool steps_aside) {
  SoftWorld world(pad_settings(16), steps_aside);
  std::vector<double> numbers;
  for (int step = 0; step < 20 * world.period_steps(); ++step) {
    const double phase = 0.01 * step;
    const Pose tool =
        ball_at(Vec3(0.01 * std::sin(phase), 0.01 * std::cos(phase), 0.048 + 0.004 * std::sin(3 * phase)));
    room_step(world, tool);
    const Vec6 wrench = as_vector(physics::soft_wrench(world.contact(0), tool));
    numbers.insert(numbers.end(), wrench.data(), wrench.data() + 6);
    for (const Vec3& node : world.nodes_W(0)) numbers.push_back(node.sum());
  }
  return numbers;
}

TEST(SoftWorker, WorkerAndInlineGiveTheSameBits) {
  const std::vector<double> at_once = story(false);
  EXPECT_EQ(at_once, story(true));
  EXPECT_EQ(at_once, story(false));
}

TEST(SoftWorker, RoomAllocatesNothingWhileAWorkerSteps) {
  SoftWorld world(pad_settings(16), true);
  soft_steps(world, ball_in_pad(0.004), 3);
  const std::uint64_t before = test::allocation_count();
  soft_steps(world, ball_in_pad(0.006), 10);
  EXPECT_EQ(test::allocation_count(), before);
}

TEST(SoftWorker, DoesNotWaitForALateWorkerAndReportsIt) {
  SoftWorldSettings settings = pad_settings(16);
  settings.waits_for_worker = false;
  std::atomic<bool> may_step{false};
  settings.before_step = [&may_step] { may_step.wait(false); };
  SoftWorld world(std::move(settings), true);
  EXPECT_EQ(soft_step(world, kAway) & kFaultSoftLate, 0U);
  EXPECT_NE(soft_step(world, kAway) & kFaultSoftLate, 0U);
  EXPECT_NE(soft_step(world, kAway) & kFaultSoftLate, 0U)
      << "the fault must be reported at every step until the result arrives";
  EXPECT_EQ(world.late_count(), 1U);
  may_step = true;
  may_step.notify_all();
  while ((room_step(world, kAway) & kFaultSoftLate) != 0) std::this_thread::yield();
  EXPECT_EQ(world.contact(0).X_WT0.p, kAway.p) << "the late result must be used";
}

}  // namespace
}  // namespace tandem::server
