// Tests SharedTurns with several threads. Fails if a turn is lost, is done twice, or still runs when run() returns. The
// test also runs under ThreadSanitizer.
#include "server/session/shared_turns.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

/// Thread that calls `help` again and again until the Helper is destroyed.
class Helper {
 public:
  explicit Helper(const std::function<void()>& help)
      : thread_([this, help] {
          while (!is_done_) help();
        }) {}
  ~Helper() {
    is_done_ = true;
    thread_.join();
  }
  Helper(const Helper&) = delete;
  Helper& operator=(const Helper&) = delete;

 private:
  std::atomic<bool> is_done_{false};
  std::thread thread_;
};

TEST(SharedTurns, EachTurnIsRunOnceBeforeRunReturns) {
  constexpr std::size_t kHelped = 50, kTurns = 7;
  SharedTurns turns;
  const auto help = [&turns] { turns.help(std::chrono::microseconds(5)); };
  const Helper one(help), another(help);
  const std::thread::id runner = std::this_thread::get_id();
  std::atomic<std::size_t> helped{0};
  while (helped < kHelped) {
    std::vector<std::size_t> taken(
        // The counts are not atomic: each turn writes its own element, and run() synchronises. ThreadSanitizer checks
        // this.
        kTurns);
    turns.run(kTurns, [&](std::size_t i) {
      ++taken[i];
      if (std::this_thread::get_id() != runner) ++helped;
      std::this_thread::yield();  // with a single processor, lets a helper run
    });
    ASSERT_EQ(taken, std::vector<std::size_t>(kTurns, 1));
  }
}

TEST(SharedTurns, AHelperWithoutWorkContinuesAtOnce) {
  SharedTurns turns;
  turns.help(std::chrono::microseconds(5));
  std::size_t taken = 0;
  turns.run(0, [&taken](std::size_t) { ++taken; });
  turns.help(std::chrono::microseconds(5));
  EXPECT_EQ(taken, 0U);
  turns.run(3, [&taken](std::size_t) { ++taken; });
  EXPECT_EQ(taken, 3U) << "alone";
}

std::string scene_of_many_hands(std::size_t count) {
  std::string tools;
  for (std::size_t i = 0; i < count; ++i) {
    tools += (i > 0 ? "," : "") + (R"({"name": "tool)" + std::to_string(i) + R"("})");
  }
  return R"({"name": "many", "bodies": [{"name": "floor", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}]}], "tools": [)" +
         tools + "]}";
}

TEST(SessionHub, SendsEachStepOnceToEachUserWhileTheRoomsThreadHelps) {
  constexpr std::size_t kUsers = 6, kLeastSteps = 1000, kMostSteps = 100'000;
  test::HubBench bench({}, {scene_of_many_hands(kUsers)});
  std::vector<test::BenchClient> users;
  for (std::size_t i = 0; i < kUsers; ++i) {
    users.push_back(bench.join("user " + std::to_string(i)));
    bench.send_state(users.back());
  }
  bench.step();  // the room accepts the users in this step
  Room& room = *bench.rooms.front();
  for (const test::BenchClient& user : users) bench.drain_datagrams(user);
  const std::uint64_t sent_before = bench.hub->counters().datagrams_sent;
  std::atomic<std::size_t> published{0};
  std::size_t steps = 0;
  {
    // Calls help() once per step, as the room thread does.
    const Helper helper([&, helped = std::size_t{0}]() mutable {
      if (published.load() == helped) return;
      helped = published.load();
      bench.hub->help(room);
    });
    // On a single processor, the helper thread may not run within kLeastSteps steps. The loop then continues for up to
    // kMostSteps.
    for (; steps < kLeastSteps || (bench.transport.sent_elsewhere == 0 && steps < kMostSteps); ++steps) {
      bench.now += std::chrono::milliseconds(1);
      room.step(server_time_of_own_clock(bench.now));
      ++published;
      bench.hub->poll(VirtualClock(bench.now));
    }
  }
  for (const test::BenchClient& user : users) EXPECT_EQ(bench.drain_datagrams(user).size(), steps);
  EXPECT_EQ(bench.hub->counters().datagrams_sent - sent_before, kUsers * steps);
  EXPECT_GT(bench.transport.sent_elsewhere, 0U) << "no other thread helped";
}

}  // namespace
}  // namespace tandem::server
