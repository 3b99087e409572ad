// The tool's end of the account: a tool that follows a pose that nobody paid for, and one that was paid for.
#include "common/haptics/passivity/tool_port_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/allocation_counter.hpp"

namespace tandem::haptics {
namespace {

constexpr double kStep = 0.001;
constexpr ToolPortGuard::Settings kGuard;
/// In the five seconds of a push.
constexpr double kUnpaid_j = 1.05 * kGuard.allowance_j + 5 * kGuard.forgiven_w;

/// A coupling that drags a body of 0.5 kg against a damper along x, towards a target that moves at 0.1 m/s.
struct PushedBody {
  /// `paid_share`: of the work on the world, what the hand's report says it has paid, late by `report_delay` steps.
  void run(int steps, double paid_share, int report_delay) {
    std::vector<double> paid;
    for (int k = 0; k < steps; ++k) {
      const double share = guard.gain(kStep);
      const double target = 0.1 * kStep * k;
      const double f = share * (300 * (target - x) - 3 * v);
      v += (f - 20 * v) / 0.5 * kStep;
      x += v * kStep;
      const double work_j = f * v * kStep;
      (work_j > 0 ? into_j : from_j) += std::abs(work_j);
      guard.stepped({Vec3(x, 0, 0), Quat::Identity()}, {Vec3(f, 0, 0), Vec3::Zero()}, into_j - from_j);
      paid.push_back(paid_share * into_j);
      if (k >= report_delay) {
        guard.hand_reported(paid[static_cast<std::size_t>(k - report_delay)], paid_share * from_j, kStep);
      }
      most_created_j = std::max(most_created_j, into_j - from_j - paid.back());
    }
  }

  ToolPortGuard guard{ToolPortGuard::Settings{}};
  double x = 0, v = 0, into_j = 0, from_j = 0, most_created_j = 0;
};

TEST(ToolPortGuard, AToolThatNobodyPaysForStopsAtTheAllowance) {
  PushedBody body;
  body.run(5000, 0.0, 0);
  EXPECT_LE(body.into_j - body.from_j, kUnpaid_j);
  EXPECT_GT(body.guard.acted_steps(), 1000U);
}

TEST(ToolPortGuard, AHandThatPaysIsNotHindered) {
  PushedBody body;
  body.run(5000, 1.0, 0);
  EXPECT_GT(body.into_j - body.from_j, 0.5) << "2 N over half a metre";
  EXPECT_EQ(body.guard.acted_steps(), 0U);
}

TEST(ToolPortGuard, WhatIsPutInNeverExceedsPaymentByMoreThanTheAllowance) {
  for (const double paid_share : {0.25, 0.5, 0.9}) {
    PushedBody body;
    body.run(5000, paid_share, 3);
    EXPECT_LE(body.most_created_j, kUnpaid_j) << paid_share;
  }
}

TEST(ToolPortGuard, BadReportsAreDroppedAndCountedAndBoundedByPower) {
  ToolPortGuard guard({});
  guard.hand_reported(0, 0, 0);
  guard.hand_reported(std::nan(""), 0, kStep);
  guard.hand_reported(1, -1, kStep);
  EXPECT_EQ(guard.dropped_reports(), 2U);
  guard.hand_reported(1e9, 0, kStep);
  EXPECT_LE(guard.account_j(), ToolPortGuard::Settings{}.account_limit_j);
  guard.hand_reported(1e8, 0, kStep);
  EXPECT_EQ(guard.dropped_reports(), 3U) << "a sum fell";
}

TEST(ToolPortGuard, IsFiniteAndWithinZeroAndOneForAnyInput) {
  ToolPortGuard guard({});
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), infinity, 1e300}) {
    guard.stepped({Vec3(bad, 0, 0), Quat::Identity()}, {Vec3(bad, 0, 0), Vec3::Zero()}, bad);
    guard.stepped({}, {Vec3(bad, 0, 0), Vec3::Zero()}, -bad);
    for (const double step : {bad, kStep}) {
      const double gain = guard.gain(step);
      EXPECT_TRUE(gain >= 0 && gain <= 1) << gain;
    }
  }
}

TEST(ToolPortGuard, AllocatesNothing) {
  ToolPortGuard guard({});
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) {
    guard.hand_reported(0.01 * k, 0, kStep);
    guard.stepped({Vec3(1e-4 * k, 0, 0), Quat::Identity()}, {Vec3(1, 0, 0), Vec3::Zero()}, 0.01 * k);
    guard.gain(kStep);
  }
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

}  // namespace
}  // namespace tandem::haptics
