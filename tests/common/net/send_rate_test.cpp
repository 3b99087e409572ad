// Tests the rate control of a sender on a link with a queue. The sender must find the rate within one second and leave
// no standing queue. Without a bottleneck it must not be limited.
#include "common/net/send_rate.hpp"

#include <gtest/gtest.h>

#include <deque>

#include "common/base/random.hpp"

namespace tandem::net {
namespace {

using std::chrono::milliseconds;
constexpr Duration kFloor = milliseconds(10);
constexpr double kMost_hz = 1000;

/// A sender at 1 kHz and a link with a queue, which transmits one message after the other at the rate `carried_hz`. The
/// sender learns of each arrival after the time `way`. The receiver's clock is one hour ahead.
struct SendRateLine {
  void run(Duration length) {
    for (const Duration end = now + length; now < end; now += milliseconds(1)) {
      while (!under_way.empty() && under_way.front().received_at <= now) {
        rate.delivered(under_way.front().sent,
                       under_way.front().arrived - under_way.front().sent + std::chrono::hours(1));
        under_way.pop_front();
      }
      if (!rate.may_send(now)) continue;
      rate.sent(now);
      ++sent;
      free_at = std::max(free_at, now) + from_seconds(1 / carried_hz);
      const Duration late = from_seconds(jitter_s * std::abs(random.normal()));
      arrived = std::max(arrived, free_at + way + late);
      under_way.push_back({now, arrived, arrived + way});
      longest_queue = std::max(longest_queue, free_at - now);
    }
  }
  double sent_per_s(Duration length) {
    sent = 0;
    longest_queue = Duration{0};
    run(length);
    return sent / to_seconds(length);
  }

  struct Message {
    Duration sent, arrived, received_at;
  };
  SendRate rate{kFloor, kMost_hz};
  double carried_hz = 1e6;
  double jitter_s = 0;
  Duration way = milliseconds(50);
  Duration now = milliseconds(1);
  Duration free_at{0}, arrived{0}, longest_queue{0};
  double sent = 0;
  std::deque<Message> under_way;
  Random random{7};
};

TEST(SendRate, IsNoLimitOnALinkThatCarriesAll) {
  SendRateLine line;
  EXPECT_EQ(line.sent_per_s(std::chrono::seconds(20)), 1000);
  EXPECT_FALSE(line.rate.is_limited());
}

TEST(SendRate, JitterDoesNotCountAsAQueue) {
  SendRateLine jittered;
  jittered.jitter_s = 0.010;
  EXPECT_EQ(jittered.sent_per_s(std::chrono::seconds(60)), 1000);
}

TEST(SendRate, ALongerRouteCountsAsAQueueForThreeSecondsOnly) {
  SendRateLine line;
  line.run(std::chrono::seconds(20));
  line.way += milliseconds(80);
  EXPECT_LT(line.sent_per_s(std::chrono::seconds(2)), 500);
  line.run(std::chrono::seconds(2));
  EXPECT_EQ(line.sent_per_s(std::chrono::seconds(10)), 1000);
}

class NarrowLink : public testing::TestWithParam<double> {};

TEST_P(NarrowLink, IsFilledButForShortQueues) {
  SendRateLine line;
  line.carried_hz = GetParam();
  line.run(std::chrono::seconds(10));
  EXPECT_GE(line.sent_per_s(std::chrono::seconds(60)), 0.7 * GetParam());
  EXPECT_LE(to_seconds(line.longest_queue), 0.150);
  EXPECT_LE(to_seconds(line.arrived - line.now), 0.250);
  EXPECT_TRUE(line.rate.is_limited());
}

INSTANTIATE_TEST_SUITE_P(Carries, NarrowLink, testing::Values(150.0, 300.0, 600.0, 900.0));

TEST(SendRate, ReturnsToTheFullRateWhenTheLinkRecovers) {
  SendRateLine line;
  line.carried_hz = 400;
  line.run(std::chrono::seconds(10));
  line.carried_hz = 1e6;
  line.run(std::chrono::seconds(90));
  EXPECT_FALSE(line.rate.is_limited());
  EXPECT_EQ(line.sent_per_s(std::chrono::seconds(5)), 1000);
}

TEST(SendRate, NeverFallsBelowTheFloor) {
  SendRateLine line;
  line.carried_hz = 20;
  line.run(std::chrono::seconds(10));
  EXPECT_GE(line.sent_per_s(std::chrono::seconds(10)), 99);
}

TEST(SendRate, ASlowSenderIsNotThinned) {
  SendRateLine line;
  line.rate = SendRate(kFloor, 60);
  line.carried_hz = 20;
  line.run(std::chrono::seconds(5));
  EXPECT_FALSE(line.rate.is_limited());
}

TEST(SendRate, ReportsAboutUnsentDatagramsAreIgnored) {
  SendRateLine line;
  line.run(std::chrono::seconds(1));
  for (int i = 1; i < 2000; ++i) line.rate.delivered(line.now + milliseconds(i), milliseconds(10 * i));
  line.run(std::chrono::seconds(1));
  EXPECT_FALSE(line.rate.is_limited());
  line.carried_hz = 300;
  line.run(std::chrono::seconds(5));
  EXPECT_TRUE(line.rate.is_limited()) << "later reports must count";
}

TEST(SendRate, StaysWithinItsBoundsForHostileReports) {
  SendRate rate(kFloor, kMost_hz);
  const Duration most(std::int64_t{1} << 61U);
  Duration now{0};
  rate.delivered(Duration{0}, most);
  for (int i = 0; i < 3000; ++i) {
    now += milliseconds(1);
    rate.sent(now);
    rate.delivered(now, i % 3 == 0 ? most : i % 3 == 1 ? -2 * most : Duration{0});
    EXPECT_TRUE(rate.may_send(now + kFloor)) << i;
  }
}

}  // namespace
}  // namespace tandem::net
