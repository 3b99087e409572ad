// The hand's end of the account: what a hand can get out of it, and what it never notices.
#include "common/haptics/passivity/guarded_port.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

constexpr double kPeriod = 1e-3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Pose at_x(double x) {
  return {Vec3(x, 0, 0), Quat::Identity()};
}
Wrench force_x(double f) {
  return {Vec3(f, 0, 0), Vec3::Zero()};
}

/// Most that a driver gets which moves along the force that it feels, of a spring that answers `delay` ticks late.
struct Taken {
  double most_j = 0;
  double withheld_j = 0;
  double force_step_max_n = 0;
};
Taken drive(int delay, bool is_guarded, std::uint64_t seed) {
  Random random(seed);
  GuardedPort guard({});
  std::deque<double> late(static_cast<std::size_t>(delay) + 1, 0.0);
  double x = 0, v = 0, taken_j = 0, f_before = 0;
  Taken result;
  for (int k = 0; k < 5000; ++k) {
    late.push_back(x);
    late.pop_front();
    double f = -500 * late.front();
    if (is_guarded) f = guard.apply(at_x(x), force_x(f), kPeriod).f.x();
    const double wanted = f != 0 ? std::copysign(0.3, f) : (random.uniform() < 0.5 ? -0.1 : 0.1);
    v += std::clamp(wanted - v, -0.09, 0.09);
    x = std::clamp(x + v * kPeriod, -0.01, 0.01);
    const double step = x - late.back();
    taken_j += f * step;
    result.most_j = std::max(result.most_j, taken_j);
    result.force_step_max_n = std::max(result.force_step_max_n, std::abs(f - f_before));
    f_before = f;
  }
  result.withheld_j = guard.withheld_j();
  return result;
}

TEST(GuardedPort, ADriverOfALateForceGetsNoMoreThanTheAllowance) {
  for (const int delay : {0, 1, 10, 100, 300}) {
    for (std::uint64_t run = 0; run < 3; ++run) {
      const std::uint64_t seed = test::test_seed(run);
      SCOPED_TRACE("delay " + std::to_string(delay) + ", seed " + std::to_string(seed));
      EXPECT_LE(drive(delay, true, seed).most_j, GuardedPort::Settings{}.allowance_j + 1e-12);
      if (delay >= 10) {
        EXPECT_GT(drive(delay, false, seed).most_j, 1e-3) << "without it the driver lives on it";
        EXPECT_GT(drive(delay, true, seed).withheld_j, 0);
      }
    }
  }
}

TEST(GuardedPort, LeavesASmoothHandInStiffContactAlone) {
  for (const double frequency_hz : {0.5, 2.0}) {
    GuardedPort guard({});
    double x_before = 0;
    int acted = 0;
    for (int k = 0; k < 4000; ++k) {
      const double x = 0.004 * std::sin(2 * std::numbers::pi * frequency_hz * k * kPeriod);
      const double v = (x - x_before) / kPeriod;
      x_before = x;
      // Half of k T of damping: what a sampled spring needs to be passive.
      const Wrench wanted = force_x(x < 0 ? -800 * x - 0.5 * v : 0.0);
      const Wrench given = guard.apply(at_x(x), wanted, kPeriod);
      acted += (given.f - wanted.f).norm() > 1e-9 ? 1 : 0;
    }
    EXPECT_EQ(acted, 0) << frequency_hz << " Hz";
    EXPECT_EQ(guard.withheld_j(), 0);
    EXPECT_GT(guard.exchanged_j(), 0.01);
  }
}

TEST(GuardedPort, WhatTheWorldGaveIsTheHandsToTakeAndNoMore) {
  GuardedPort guard({});
  double from_world_j = 0, taken_j = 0, x = 0;
  for (int k = 0; k < 5000; ++k) {
    if (k % 5 == 0) {
      if (k < 2500) from_world_j += 1e-3;
      guard.world_reported(from_world_j, 0, 0.005);
    }
    const double f = guard.apply(at_x(x), force_x(3), kPeriod).f.x();
    x += 0.2 * kPeriod;
    taken_j += f * 0.2 * kPeriod;
    ASSERT_LE(taken_j, from_world_j + GuardedPort::Settings{}.allowance_j + 1e-12);
  }
  EXPECT_GT(taken_j, 0.9 * from_world_j);
}

TEST(GuardedPort, WhatTheWorldGotBeforeItMustGiveBackFirst) {
  GuardedPort guard({});
  guard.world_reported(0, 0, 0);
  guard.world_reported(0, 1.0, 0.005);
  guard.world_reported(0.9, 1.0, 0.1);
  EXPECT_EQ(guard.account_j(), 0);
  guard.world_reported(1.2, 1.0, 0.1);
  EXPECT_NEAR(guard.account_j(), 0.2, 1e-12);
}

TEST(GuardedPort, ALostReportDoesNoHarm) {
  GuardedPort all({}), some({});
  for (int k = 0; k <= 100; ++k) {
    const double from_j = 0.01 * k, into_j = 0.004 * k;
    all.world_reported(from_j, into_j, 0.005);
    if (k % 10 == 0) some.world_reported(from_j, into_j, 0.05);
  }
  EXPECT_NEAR(all.account_j(), 0.6, 1e-12);
  EXPECT_NEAR(some.account_j(), 0.6, 1e-12);
}

TEST(GuardedPort, ReportsThatArriveInABunchAreBelievedWhole) {
  GuardedPort guard({});
  guard.world_reported(0, 0, 0);
  // 2 W for a second, delivered ten at a time, 0.1 ms apart.
  for (int k = 1; k <= 200; ++k) guard.world_reported(0.005 * 2 * k, 0, k % 10 == 0 ? 0.05 : 1e-4);
  EXPECT_NEAR(guard.account_j(), 2, 1e-9);
}

TEST(GuardedPort, ALyingServerIsBelievedWithinThePowerLimitOnly) {
  GuardedPort::Settings settings;
  settings.credit_limit_w = 5;
  settings.account_limit_j = 1e3;
  GuardedPort guard(settings);
  guard.world_reported(0, 0, 0);
  guard.world_reported(1e6, 0, 0.1);
  EXPECT_LE(guard.account_j(), 5 * 1.0) << "a second's worth at once";
  const double before_j = guard.account_j();
  for (int k = 1; k <= 20; ++k) guard.world_reported(1e6 + 1e5 * k, 0, 0.1);
  EXPECT_LE(guard.account_j() - before_j, 5 * 2.0 + 1e-9);
}

TEST(GuardedPort, ASumThatFallsOrIsNotFiniteIsDroppedAndCounted) {
  GuardedPort guard({});
  guard.world_reported(1, 1, 0.005);
  for (const double bad : {0.5, -1.0, kInfinity, std::nan("")}) {
    guard.world_reported(bad, 2, 0.005);
    guard.world_reported(2, bad, 0.005);
  }
  EXPECT_EQ(guard.dropped_reports(), 8U);
  EXPECT_EQ(guard.account_j(), 0);
}

TEST(GuardedPort, ALocalBodyThatGivesBackWhatItGotAddsNothing) {
  GuardedPort guard({});
  guard.local_gave(0.3);
  EXPECT_EQ(guard.account_j(), 0) << "the first only says where to count from";
  for (const double net_j : {0.1, -0.2, 0.29}) guard.local_gave(net_j);
  EXPECT_NEAR(guard.account_j(), 0, 1e-12);
  guard.local_gave(std::nan(""));
  guard.local_gave(0.5);
  EXPECT_NEAR(guard.account_j(), 0.2, 1e-12);
}

TEST(GuardedPort, ComesBackSlowlyAfterItActed) {
  GuardedPort::Settings settings;
  GuardedPort guard(settings);
  guard.apply(at_x(0), force_x(5), kPeriod);
  ASSERT_LT(guard.gain(), 1);
  const double low = guard.gain();
  guard.world_reported(0, 0, 0);
  guard.world_reported(1, 0, 0.1);
  double before = low;
  for (int k = 0; k < 60; ++k) {
    guard.apply(at_x(0), force_x(5), kPeriod);
    ASSERT_LE(guard.gain() - before, kPeriod / settings.rise_s + 1e-12);
    before = guard.gain();
  }
  EXPECT_EQ(guard.gain(), 1);
}

TEST(GuardedPort, CountsWhatWasReallyDisplayed) {
  GuardedPort guard({});
  guard.apply(at_x(0), force_x(-0.01), kPeriod);
  guard.set_displayed(force_x(-2));
  guard.apply(at_x(0.001), force_x(-0.01), kPeriod);
  EXPECT_NEAR(guard.account_j(), 2e-3, 1e-12);
}

TEST(GuardedPort, LeavesOutWhatAHandDidUnseen) {
  GuardedPort guard({});
  guard.apply(at_x(0), force_x(-2), kPeriod);
  guard.lose_hand();
  guard.apply(at_x(0.5), force_x(-2), kPeriod);
  EXPECT_EQ(guard.account_j(), 0);
}

TEST(GuardedPort, DissipationLeavesNoMoreLicenceThanTheLimit) {
  GuardedPort::Settings settings;
  settings.account_limit_j = 0.1;
  GuardedPort guard(settings);
  for (int k = 0; k < 1000; ++k) {
    guard.apply(at_x(0.001 * k), force_x(0), kPeriod);
    guard.set_displayed(force_x(-3));
  }
  EXPECT_EQ(guard.account_j(), 0.1);
}

TEST(GuardedPort, IsFiniteForAnyInputAndKeepsItsAccount) {
  GuardedPort guard({});
  guard.world_reported(0, 0, 0);
  guard.world_reported(0.5, 0, 0.1);
  const double nan = std::nan("");
  for (const double bad : {nan, kInfinity, 1e300}) {
    EXPECT_TRUE(is_finite(guard.apply(at_x(0), force_x(bad), kPeriod)));
    EXPECT_TRUE(is_finite(guard.apply(at_x(bad), force_x(1), kPeriod)));
    guard.lose_hand();
    guard.set_displayed(force_x(bad));
  }
  EXPECT_EQ(guard.apply(at_x(0), force_x(1), nan).f.norm(), 0);
  EXPECT_TRUE(std::isfinite(guard.account_j()));
}

TEST(GuardedPort, ResetForgetsTheAccountAndKeepsTheFigures) {
  GuardedPort guard({});
  guard.apply(at_x(0), force_x(-2), kPeriod);
  guard.apply(at_x(0.01), force_x(-2), kPeriod);
  ASSERT_GT(guard.account_j(), 0);
  const double exchanged_j = guard.exchanged_j();
  guard.reset();
  EXPECT_EQ(guard.account_j(), 0);
  EXPECT_EQ(guard.exchanged_j(), exchanged_j);
}

TEST(GuardedPort, AllocatesNothing) {
  GuardedPort guard({});
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) {
    guard.world_reported(0.01 * k, 0, 0.001);
    guard.apply(at_x(1e-4 * k), force_x(3), kPeriod);
    guard.set_displayed(force_x(2));
  }
  guard.reset();
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

}  // namespace
}  // namespace tandem::haptics
