// A tool whose hand supplies the energy that it puts into the world, and one whose hand does not.
#include "common/haptics/passivity/tool_passivity_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/allocation_counter.hpp"

namespace tandem::haptics {
namespace {

constexpr double kStep = 0.001;
/// Beyond what the hand supplied, in the five seconds of a push.
constexpr double kMaxCreated_j =
    1.05 * ToolPassivityController::kInitialCredit_j + 5 * ToolPassivityController::kLeakRate_w;

/// A coupling that drags a body of 0.5 kg against a damper along x, towards a target that moves at 0.1 m/s.
struct PushedBody {
  /// `supplied_share`: of the work on the world, what the hand's report says that it put in, late by `report_delay`
  /// steps.
  void run(int steps, double supplied_share, int report_delay) {
    std::vector<double> supplied;
    for (int k = 0; k < steps; ++k) {
      const double share = controller.gain(kStep);
      const double target = 0.1 * kStep * k;
      const double f = share * (300 * (target - x) - 3 * v);
      v += (f - 20 * v) / 0.5 * kStep;
      x += v * kStep;
      const double work_j = f * v * kStep;
      (work_j > 0 ? into_j : from_j) += std::abs(work_j);
      controller.stepped({Vec3(x, 0, 0), Quat::Identity()}, {Vec3(f, 0, 0), Vec3::Zero()}, into_j - from_j);
      supplied.push_back(supplied_share * into_j);
      if (k >= report_delay) {
        controller.hand_reported(supplied[static_cast<std::size_t>(k - report_delay)], supplied_share * from_j, kStep);
      }
      most_created_j = std::max(most_created_j, into_j - from_j - supplied.back());
    }
  }

  ToolPassivityController controller;
  double x = 0, v = 0, into_j = 0, from_j = 0, most_created_j = 0;
};

TEST(ToolPassivityController, AToolWhoseHandSuppliesNothingStopsAtTheInitialCredit) {
  PushedBody body;
  body.run(5000, 0.0, 0);
  EXPECT_LE(body.into_j - body.from_j, kMaxCreated_j);
  EXPECT_GT(body.controller.limited_steps(), 1000U);
}

TEST(ToolPassivityController, AHandThatSuppliesItIsNotHindered) {
  PushedBody body;
  body.run(5000, 1.0, 0);
  EXPECT_GT(body.into_j - body.from_j, 0.5) << "2 N over half a metre";
  EXPECT_EQ(body.controller.limited_steps(), 0U);
}

TEST(ToolPassivityController, WhatIsPutInNeverExceedsTheSupplyByMoreThanTheInitialCredit) {
  for (const double supplied_share : {0.25, 0.5, 0.9}) {
    PushedBody body;
    body.run(5000, supplied_share, 3);
    EXPECT_LE(body.most_created_j, kMaxCreated_j) << supplied_share;
  }
}

TEST(ToolPassivityController, BadReportsAreDroppedAndCountedAndTheBalanceIsBounded) {
  ToolPassivityController controller;
  controller.hand_reported(0, 0, 0);
  controller.hand_reported(std::nan(""), 0, kStep);
  controller.hand_reported(1, -1, kStep);
  EXPECT_EQ(controller.dropped_reports(), 2U);
  controller.hand_reported(1e9, 0, kStep);
  EXPECT_LE(controller.balance_j(), ToolPassivityController::kMaxBalance_j);
  controller.hand_reported(1e8, 0, kStep);
  EXPECT_EQ(controller.dropped_reports(), 3U) << "a sum fell";
}

TEST(ToolPassivityController, ANegativeBalanceLeaksAwayAndIsClearedWhereTheHandleStartsAnew) {
  ToolPassivityController controller;
  controller.hand_reported(0, 0, 0);
  controller.hand_reported(0, 5, kStep);
  EXPECT_EQ(controller.balance_j(), ToolPassivityController::kMinBalance_j) << "the hand got 5 J";
  EXPECT_EQ(controller.gain(kStep), 0);
  for (int i = 0; i < 26000; ++i) controller.gain(kStep);
  EXPECT_EQ(controller.balance_j(), 0);
  controller.hand_reported(0, 10, kStep);
  controller.restart_handle(0.2);
  EXPECT_NEAR(controller.balance_j(), 0.2, 1e-12) << "what the coupling stores is credited";
}

TEST(ToolPassivityController, IsFiniteAndWithinZeroAndOneForAnyInput) {
  ToolPassivityController controller;
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), infinity, 1e300}) {
    controller.stepped({Vec3(bad, 0, 0), Quat::Identity()}, {Vec3(bad, 0, 0), Vec3::Zero()}, bad);
    controller.stepped({}, {Vec3(bad, 0, 0), Vec3::Zero()}, -bad);
    for (const double step : {bad, kStep}) {
      const double gain = controller.gain(step);
      EXPECT_TRUE(gain >= 0 && gain <= 1) << gain;
    }
  }
}

TEST(ToolPassivityController, AllocatesNothing) {
  ToolPassivityController controller;
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) {
    controller.hand_reported(0.01 * k, 0, kStep);
    controller.stepped({Vec3(1e-4 * k, 0, 0), Quat::Identity()}, {Vec3(1, 0, 0), Vec3::Zero()}, 0.01 * k);
    controller.gain(kStep);
  }
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

}  // namespace
}  // namespace tandem::haptics
