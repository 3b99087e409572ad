#include "common/realtime/rate_watch.hpp"

#include <gtest/gtest.h>

namespace tandem::realtime {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

struct Loop {
  /// Simulates ticks for the duration `span`. Returns whether the loop counts as slow at the last tick.
  bool run(Duration period, Duration span) {
    bool is_slow = false;
    for (Duration t{0}; t < span; t += period) is_slow = watch.is_slow(now += period);
    return is_slow;
  }
  RateWatch watch{milliseconds(1)};
  LocalTime now{std::chrono::seconds(7)};
};

TEST(RateWatch, SeesALoopBelow90PercentWithin150Milliseconds) {
  Loop loop;
  EXPECT_FALSE(loop.run(milliseconds(1), milliseconds(500)));
  EXPECT_FALSE(loop.run(microseconds(1200), milliseconds(50))) << "not for long enough";
  EXPECT_TRUE(loop.run(microseconds(1200), milliseconds(100)));
  EXPECT_TRUE(loop.run(microseconds(1200), milliseconds(500)));
  EXPECT_FALSE(loop.run(milliseconds(1), milliseconds(110))) << "it has caught up";
}

TEST(RateWatch, AcceptsALoopThatIsSlightlyLateOrHasOneHiccup) {
  Loop loop;
  EXPECT_FALSE(loop.run(microseconds(1090), std::chrono::seconds(1)));
  loop.now += milliseconds(40);
  for (int i = 0; i < 300; ++i) ASSERT_FALSE(loop.run(milliseconds(1), milliseconds(1))) << i;
}

TEST(RateWatch, HasNoResultBeforeTwoWindowsAndAfterAPause) {
  Loop loop;
  EXPECT_FALSE(loop.run(milliseconds(10), milliseconds(890)));
  EXPECT_TRUE(loop.run(milliseconds(10), milliseconds(100)));
  loop.watch.restart();
  EXPECT_FALSE(loop.run(milliseconds(10), milliseconds(890)));
}

}  // namespace
}  // namespace tandem::realtime
