// Tests the filtered Unix time: short steps of the wall clock must have no effect, and lasting steps must be followed
// after 10 s.
#include "server/session/unix_time.hpp"

#include <gtest/gtest.h>

#include "common/base/random.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kStart_ms = 1'700'000'000'000;

LocalTime after(Duration duration) {
  return LocalTime(1000s) + duration;
}

TEST(UnixTime, IsTheWallClocksWhereThatRuns) {
  UnixTime time;
  for (int second = 0; second < 100; ++second) {
    const std::uint64_t wall_ms = kStart_ms + 1000U * static_cast<unsigned>(second) + static_cast<unsigned>(second);
    EXPECT_EQ(time.update(wall_ms, after(second * 1s)), wall_ms) << "drift of 0.1 % is followed";
    EXPECT_FALSE(time.follows_in(after(second * 1s)));
  }
}

TEST(UnixTime, StepsThatLastLessThanTenSecondsChangeNothing) {
  Random random(test::test_seed(1));
  UnixTime time;
  std::uint64_t now_ms = 0;
  time.update(kStart_ms, after(0s));
  for (int step = 0; step < 1000; ++step) {
    const auto far = static_cast<std::int64_t>(random.uniform(2e3, 1e11)) * (random.next_u32() % 2 == 0 ? 1 : -1);
    const std::uint64_t lasts_ms = random.next_u32() % 10'000;
    for (const std::uint64_t at_ms : {now_ms, now_ms + lasts_ms}) {
      const auto wall_ms = static_cast<std::uint64_t>(static_cast<std::int64_t>(kStart_ms + at_ms) + far);
      EXPECT_EQ(time.update(wall_ms, after(at_ms * 1ms)), kStart_ms + at_ms);
    }
    now_ms += lasts_ms;
    EXPECT_EQ(time.update(kStart_ms + now_ms, after(now_ms * 1ms)), kStart_ms + now_ms);
    EXPECT_FALSE(time.follows_in(after(now_ms * 1ms)));
  }
}

TEST(UnixTime, AStepThatLastsIsFollowedInBothDirections) {
  UnixTime time;
  time.update(kStart_ms, after(0s));
  std::uint64_t wall_ms = kStart_ms;
  Duration now = 0s;
  for (const std::int64_t step_ms :
       std::initializer_list<std::int64_t>{5'000, -5'000, 31'536'000'000, -31'536'000'000}) {
    const std::uint64_t before_ms = time.at(after(now));
    wall_ms += static_cast<std::uint64_t>(step_ms);
    time.update(wall_ms, after(now));
    EXPECT_EQ(time.follows_in(after(now)), kClockHold);
    EXPECT_EQ(time.update(wall_ms + 9999, after(now + 9999ms)), before_ms + 9999);
    EXPECT_EQ(time.update(wall_ms + 10'000, after(now + 10s)), wall_ms + 10'000);
    EXPECT_FALSE(time.follows_in(after(now + 10s)));
    now += 10s;
    wall_ms += 10'000;
  }
}

TEST(UnixTime, AClockThatIsBehindTheRunBeforeIsFollowedAfterTenSecondsToo) {
  UnixTime time(kStart_ms + 60'000);
  EXPECT_EQ(time.update(kStart_ms, after(0s)), kStart_ms + 60'000);
  EXPECT_EQ(time.update(kStart_ms + 5000, after(5s)), kStart_ms + 65'000);
  EXPECT_EQ(time.update(kStart_ms + 10'000, after(10s)), kStart_ms + 10'000);
  UnixTime ahead(kStart_ms - 60'000);
  EXPECT_EQ(ahead.update(kStart_ms, after(0s)), kStart_ms) << "time passes between two runs";
}

TEST(UnixTime, ABrokenClockOverflowsNothing) {
  UnixTime time(UINT64_MAX);
  for (const std::uint64_t wall_ms : {UINT64_MAX, std::uint64_t{0}, UINT64_MAX, kStart_ms}) {
    for (const Duration at : {0s, 20s}) EXPECT_LT(time.update(wall_ms, after(at)), 253'402'300'800'000U + 20'000U);
  }
}

TEST(UnixTime, IsWrittenInUtc) {
  EXPECT_EQ(utc_text(1'795'325'107'000), "2026-11-22 05:25:07 UTC");
}

}  // namespace
}  // namespace tandem::server
