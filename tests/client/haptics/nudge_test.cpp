// Tests the force pulses of a nudge: their number, direction, size and duration.
#include "client/haptics/nudge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>

namespace tandem::client {
namespace {

constexpr double kPeriod_s = 0.001;
const Quat kTurned = quaternion_of(Vec3(0, 0, std::numbers::pi / 2));

/// Number of separate force pulses within one second, and the largest force.
struct Pulses {
  int count = 0;
  double largest_n = 0;
};

Pulses pulses_of(Nudge& nudge) {
  Pulses pulses;
  double before_n = 0;
  for (int i = 0; i < 1000; ++i) {
    nudge.advance(kPeriod_s, true);
    const double now_n = nudge.on_hand_D().norm();
    pulses.count += before_n == 0 && now_n > 0 ? 1 : 0;
    pulses.largest_n = std::max(pulses.largest_n, now_n);
    before_n = now_n;
  }
  return pulses;
}

TEST(Nudge, PushesThreeTimesAndEnds) {
  Nudge nudge(8);
  nudge.begin({0.1, 0, 0}, Quat::Identity());
  const Pulses pulses = pulses_of(nudge);
  EXPECT_EQ(pulses.count, 3);
  EXPECT_NEAR(pulses.largest_n, 0.3, 1e-3);
  EXPECT_FALSE(nudge.is_running());
}

TEST(Nudge, IsATenthOfTheLimitOfAWeakDevice) {
  Nudge nudge(1);
  nudge.begin({0.1, 0, 0}, Quat::Identity());
  EXPECT_NEAR(pulses_of(nudge).largest_n, 0.1, 1e-3);
}

TEST(Nudge, PointsAlongTheWayInTheFrameOfTheDevice) {
  Nudge nudge(8);
  nudge.begin({0.2, 0, 0}, kTurned);
  for (int i = 0; i < 40; ++i) nudge.advance(kPeriod_s, true);
  EXPECT_LT((nudge.on_hand_D().normalized() - Vec3::UnitY()).norm(), 1e-12);
}

TEST(Nudge, IsNotInterruptedByAnotherPlace) {
  Nudge nudge(8);
  nudge.begin({0.1, 0, 0}, Quat::Identity());
  for (int i = 0; i < 40; ++i) nudge.advance(kPeriod_s, true);
  nudge.begin({0, 0.1, 0}, Quat::Identity());
  nudge.advance(kPeriod_s, true);
  EXPECT_GT(nudge.on_hand_D().x(), 0);
  EXPECT_EQ(nudge.on_hand_D().y(), 0);
}

TEST(Nudge, EndsAtOnceWhereItMayNotPush) {
  Nudge nudge(8);
  nudge.begin({0.1, 0, 0}, Quat::Identity());
  for (int i = 0; i < 40; ++i) nudge.advance(kPeriod_s, true);
  nudge.advance(kPeriod_s, false);
  EXPECT_TRUE(nudge.on_hand_D().isZero(0));
  EXPECT_FALSE(nudge.is_running());
}

TEST(Nudge, DoesNotStartWithoutADirection) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& way : {Vec3(0, 0, 0), Vec3(unknown, 0, 0), Vec3(1e-7, 0, 0)}) {
    Nudge nudge(8);
    nudge.begin(way, Quat::Identity());
    EXPECT_FALSE(nudge.is_running());
  }
}

}  // namespace
}  // namespace tandem::client
