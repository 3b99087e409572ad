// Tests that FairTurns satisfies the bounds (1) and (2) stated in fair_turns.hpp. If a bound fails, one room can delay
// other rooms.
#include "server/docking/fair_turns.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <vector>

#include "common/base/random.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

constexpr std::uint64_t kLargest = 1000;

/// Rooms that FairTurns serves. Counts the work done for each room.
struct Bench {
  explicit Bench(std::size_t rooms) : turns(rooms), jobs(rooms), served(rooms) {}

  bool has_work(std::size_t room) const { return !jobs[room].empty(); }
  /// Does the next slice of work. Returns the room that the slice belongs to, or none if no room has work.
  std::optional<std::size_t> serve() {
    const auto next = turns.next([this](std::size_t i) { return has_work(i); });
    if (!next) return next;
    turns.charge(*next, jobs[*next].front());
    served[*next] += jobs[*next].front();
    jobs[*next].pop_front();
    return next;
  }

  FairTurns turns;
  std::vector<std::deque<std::uint64_t>> jobs;  ///< work of the remaining slices of each room
  std::vector<std::uint64_t> served;
};

TEST(FairTurns, LongWorkOfOneRoomDoesNotDelayASmallRequestOfAnother) {
  Bench bench(2);
  bench.jobs[0].assign(500, kLargest);
  for (int i = 0; i < 100; ++i) bench.serve();
  bench.jobs[1].push_back(1);
  bench.serve();
  EXPECT_EQ(bench.served[1], 1U);
}

TEST(FairTurns, SlicesOfAnySizeShareTheTimeEvenly) {
  Bench bench(2);
  bench.jobs[0].assign(100, kLargest);
  bench.jobs[1].assign(10'000, kLargest / 100);
  for (int i = 0; i < 2000; ++i) bench.serve();
  EXPECT_NEAR(static_cast<double>(bench.served[0]), static_cast<double>(bench.served[1]), kLargest);
}

/// Checks the bounds (1) and (2) of fair_turns.hpp for random sequences of requests.
class FairTurnsProperty : public ::testing::TestWithParam<int> {};

TEST_P(FairTurnsProperty, NoRoomWaitsForMoreThanTwoSlicesOfEachOther) {
  Random random(test::test_seed(2026), static_cast<std::uint64_t>(GetParam()));
  const auto below = [&random](std::uint64_t end) { return random.next_u64() % end; };
  const std::size_t rooms = 2 + below(7);
  Bench bench(rooms);
  // State of the wait of each room that has received no slice since it got work: the work that every room had received
  // when the wait began.
  std::vector<std::optional<std::vector<std::uint64_t>>> since_it_waits(rooms);
  // For each pair of rooms: whether both rooms have work (are_both), and how much more work the first one has received
  // than the second since then (lead).
  std::vector<std::vector<bool>> are_both(rooms, std::vector<bool>(rooms));
  std::vector<std::vector<std::int64_t>> lead(rooms, std::vector<std::int64_t>(rooms));
  for (int turn = 0; turn < 3000; ++turn) {
    while (below(4) == 0) {
      const std::size_t room = below(rooms);
      if (!bench.has_work(room)) since_it_waits[room] = bench.served;
      const std::uint64_t size = below(3) == 0 ? kLargest : 1 + below(kLargest);
      bench.jobs[room].insert(bench.jobs[room].end(), 1 + below(below(10) == 0 ? 300 : 5), size);
    }
    for (std::size_t i = 0; i < rooms; ++i) {
      for (std::size_t j = 0; j < rooms; ++j) {
        const bool were_both = are_both[i][j];
        are_both[i][j] = bench.has_work(i) && bench.has_work(j);
        if (!were_both || !are_both[i][j]) lead[i][j] = 0;
      }
    }
    const std::vector<std::uint64_t> before = bench.served;
    const bool is_any = std::ranges::any_of(bench.jobs, [](const auto& jobs) { return !jobs.empty(); });
    const auto served = bench.serve();
    ASSERT_EQ(served.has_value(), is_any);
    if (!served) continue;
    if (since_it_waits[*served]) {
      for (std::size_t other = 0; other < rooms; ++other) {
        if (other == *served) continue;
        EXPECT_LE(before[other] - (*since_it_waits[*served])[other], 2 * kLargest) << "room " << other;
      }
      since_it_waits[*served].reset();
    }
    const auto work = static_cast<std::int64_t>(bench.served[*served] - before[*served]);
    for (std::size_t other = 0; other < rooms; ++other) {
      lead[*served][other] += work;
      lead[other][*served] -= work;
      if (other == *served || !are_both[*served][other]) continue;
      EXPECT_LE(std::abs(lead[*served][other]), static_cast<std::int64_t>(2 * kLargest))
          << "rooms " << *served << ", " << other;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sequences, FairTurnsProperty, ::testing::Range(0, 60));

}  // namespace
}  // namespace tandem::server
