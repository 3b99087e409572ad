// Tests how much energy a hand can extract from a port that the controller limits. Also tests interactions in which the
// controller must not act.
#include "common/haptics/passivity/hand_passivity_controller.hpp"

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

constexpr double kHandPassivityControllerPeriod = 1e-3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Pose hand_at_x(double x) {
  return {Vec3(x, 0, 0), Quat::Identity()};
}
Wrench hand_force_x(double f) {
  return {Vec3(f, 0, 0), Vec3::Zero()};
}

/// Results of a run with a simulated hand on a spring of 500 N/m. The hand always moves in the direction of the force,
/// which is computed from the position of `delay` ticks ago. It therefore extracts as much energy as it can.
struct HandPassivityControllerTaken {
  double most_j = 0;
  double withheld_j = 0;
  double force_step_max_n = 0;
};
HandPassivityControllerTaken drive(int delay, bool is_controlled, std::uint64_t seed) {
  Random random(seed);
  HandPassivityController controller;
  std::deque<double> late(static_cast<std::size_t>(delay) + 1, 0.0);
  double x = 0, v = 0, taken_j = 0, f_before = 0;
  HandPassivityControllerTaken result;
  for (int k = 0; k < 5000; ++k) {
    late.push_back(x);
    late.pop_front();
    double f = -500 * late.front();
    if (is_controlled) f = controller.apply(hand_at_x(x), hand_force_x(f), kHandPassivityControllerPeriod).f.x();
    const double wanted = f != 0 ? std::copysign(0.3, f) : (random.uniform() < 0.5 ? -0.1 : 0.1);
    v += std::clamp(wanted - v, -0.09, 0.09);
    x = std::clamp(x + v * kHandPassivityControllerPeriod, -0.01, 0.01);
    const double step = x - late.back();
    taken_j += f * step;
    result.most_j = std::max(result.most_j, taken_j);
    result.force_step_max_n = std::max(result.force_step_max_n, std::abs(f - f_before));
    f_before = f;
  }
  result.withheld_j = controller.withheld_j();
  return result;
}

/// Returns the upper limit of the energy that a hand can extract beyond its own supply: the initial credit plus the
/// leak.
double most_for_nothing_j(double seconds) {
  return HandPassivityController::kInitialCredit_j + HandPassivityController::kLeakRate_w * seconds + 1e-9;
}

TEST(HandPassivityController, ADriverOfALateForceGetsNoMoreThanTheInitialCreditAndTheLeak) {
  for (const int delay : {0, 1, 10, 100, 300}) {
    for (std::uint64_t run = 0; run < 3; ++run) {
      const std::uint64_t seed = test::test_seed(run);
      SCOPED_TRACE("delay " + std::to_string(delay) + ", seed " + std::to_string(seed));
      EXPECT_LE(drive(delay, true, seed).most_j, most_for_nothing_j(5));
      if (delay >= 10) {
        EXPECT_GT(drive(delay, false, seed).most_j, 2 * most_for_nothing_j(5)) << "without it the driver lives on it";
        EXPECT_GT(drive(delay, true, seed).withheld_j, 0);
      }
    }
  }
}

TEST(HandPassivityController, LeavesASmoothHandInStiffContactAlone) {
  for (const double frequency_hz : {0.5, 2.0}) {
    HandPassivityController controller;
    double x_before = 0;
    int acted = 0;
    for (int k = 0; k < 4000; ++k) {
      const double x = 0.004 * std::sin(2 * std::numbers::pi * frequency_hz * k * kHandPassivityControllerPeriod);
      const double v = (x - x_before) / kHandPassivityControllerPeriod;
      x_before = x;
      // The damping is k T/2, the smallest damping with which a sampled spring is passive, so the controller must not
      // act.
      const Wrench wanted = hand_force_x(x < 0 ? -800 * x - 0.5 * v : 0.0);
      const Wrench given = controller.apply(hand_at_x(x), wanted, kHandPassivityControllerPeriod);
      acted += (given.f - wanted.f).norm() > 1e-9 ? 1 : 0;
    }
    EXPECT_EQ(acted, 0) << frequency_hz << " Hz";
    EXPECT_EQ(controller.withheld_j(), 0);
    EXPECT_GT(controller.exchanged_j(), 0.01);
  }
}

TEST(HandPassivityController, TheHandMayReceiveTheEnergyOfTheWorldAndNoMore) {
  HandPassivityController controller;
  double from_world_j = 0, taken_j = 0, x = 0;
  for (int k = 0; k < 5000; ++k) {
    if (k % 5 == 0) {
      if (k < 2500) from_world_j += 1e-3;
      controller.world_reported(from_world_j, 0, 0.005);
    }
    const double f = controller.apply(hand_at_x(x), hand_force_x(3), kHandPassivityControllerPeriod).f.x();
    x += 0.2 * kHandPassivityControllerPeriod;
    taken_j += f * 0.2 * kHandPassivityControllerPeriod;
    ASSERT_LE(taken_j, from_world_j + most_for_nothing_j(k * kHandPassivityControllerPeriod));
  }
  EXPECT_GT(taken_j, 0.9 * from_world_j);
}

TEST(HandPassivityController, EnergyGivenToTheWorldCannotReturnToTheHand) {
  HandPassivityController controller;
  controller.world_reported(0, 0, 0);
  controller.world_reported(1.0, 0, 0.1);
  controller.world_reported(1.0, 0.7, 0.1);
  EXPECT_NEAR(controller.balance_j(), 0.3, 1e-12);
  controller.world_reported(1.0, 5, 0.1);
  EXPECT_EQ(controller.balance_j(), HandPassivityController::kMinBalance_j)
      << "a debt is bounded, so that it is over soon";
}

TEST(HandPassivityController, WhatTheWorldTookOfAHandWithAModelOfItsOwnItMustGiveBackFirst) {
  HandPassivityController controller;
  controller.world_reported(0, 0, 0, true);
  controller.world_reported(0, 1.0, 0.005, true);
  controller.world_reported(0.9, 1.0, 0.1, true);
  EXPECT_EQ(controller.balance_j(), 0) << "the hand paid its model";
  controller.world_reported(1.2, 1.0, 0.1, true);
  EXPECT_NEAR(controller.balance_j(), 0.2, 1e-12);
}

TEST(HandPassivityController, ALostReportDoesNoHarm) {
  HandPassivityController all, some;
  for (int k = 0; k <= 100; ++k) {
    const double from_j = 0.01 * k, into_j = 0.004 * k;
    all.world_reported(from_j, into_j, 0.005);
    if (k % 10 == 0) some.world_reported(from_j, into_j, 0.05);
  }
  EXPECT_NEAR(all.balance_j(), 0.6, 1e-12);
  EXPECT_NEAR(some.balance_j(), 0.6, 1e-12);
}

TEST(HandPassivityController, ASumThatFallsOrIsNotFiniteIsDroppedAndCounted) {
  HandPassivityController controller;
  controller.world_reported(1, 1, 0.005);
  for (const double bad : {0.5, -1.0, kInfinity, std::nan("")}) {
    controller.world_reported(bad, 2, 0.005);
    controller.world_reported(2, bad, 0.005);
  }
  EXPECT_EQ(controller.dropped_reports(), 8U);
  EXPECT_EQ(controller.balance_j(), 0);
}

TEST(HandPassivityController, ALocalBodyThatReturnsItsEnergyAddsNothing) {
  HandPassivityController controller;
  controller.local_model_reported(0.3);
  EXPECT_EQ(controller.balance_j(), 0) << "the first only says where to count from";
  for (const double net_j : {0.1, -0.2, 0.29}) controller.local_model_reported(net_j);
  EXPECT_NEAR(controller.balance_j(), 0, 1e-12);
  controller.local_model_reported(std::nan(""));
  controller.local_model_reported(0.5);
  EXPECT_NEAR(controller.balance_j(), 0.2, 1e-12);
}

TEST(HandPassivityController, IsReleasedSlowlyAfterItActed) {
  constexpr double kRise_s = 0.05;
  HandPassivityController controller;
  controller.apply(hand_at_x(0), hand_force_x(5), kHandPassivityControllerPeriod);
  controller.apply(hand_at_x(0.001), hand_force_x(5), kHandPassivityControllerPeriod);
  ASSERT_LT(controller.gain(), 1);
  const double low = controller.gain();
  controller.world_reported(0, 0, 0);
  controller.world_reported(1, 0, 0.1);
  double before = low;
  for (int k = 0; k < 60; ++k) {
    controller.apply(hand_at_x(0.001), hand_force_x(5), kHandPassivityControllerPeriod);
    ASSERT_LE(controller.gain() - before, kHandPassivityControllerPeriod / kRise_s + 1e-12);
    before = controller.gain();
  }
  EXPECT_EQ(controller.gain(), 1);
}

TEST(HandPassivityController, ADebtDoesNotReduceTheForceAtRestOrWhileTheHandSuppliesEnergy) {
  HandPassivityController controller;
  controller.apply(hand_at_x(0), hand_force_x(4), kHandPassivityControllerPeriod);
  controller.set_displayed(hand_force_x(4));
  controller.apply(hand_at_x(0.0003), hand_force_x(4), kHandPassivityControllerPeriod);
  ASSERT_LT(controller.balance_j(), -HandPassivityController::kInitialCredit_j);
  ASSERT_EQ(controller.gain(), 0) << "the hand has received energy and would continue";
  double x = 0.0003;
  for (int k = 0; k < 1000; ++k) controller.apply(hand_at_x(x), hand_force_x(4), kHandPassivityControllerPeriod);
  EXPECT_GT(controller.gain(), 0.99) << "the gain must recover at rest";
  for (int k = 0; k < 10; ++k) controller.apply(hand_at_x(x -= 1e-4), hand_force_x(4), kHandPassivityControllerPeriod);
  EXPECT_EQ(controller.gain(), 1) << "the hand supplies energy";
}

TEST(HandPassivityController, CountsTheDisplayedForce) {
  HandPassivityController controller;
  controller.apply(hand_at_x(0), hand_force_x(-0.01), kHandPassivityControllerPeriod);
  controller.set_displayed(hand_force_x(-2));
  controller.apply(hand_at_x(0.001), hand_force_x(-0.01), kHandPassivityControllerPeriod);
  EXPECT_NEAR(controller.balance_j(), 2e-3, 1e-12);
}

TEST(HandPassivityController, IgnoresMotionWhileTheHandIsLost) {
  HandPassivityController controller;
  controller.apply(hand_at_x(0), hand_force_x(-2), kHandPassivityControllerPeriod);
  controller.lose_hand();
  controller.apply(hand_at_x(0.5), hand_force_x(-2), kHandPassivityControllerPeriod);
  EXPECT_EQ(controller.balance_j(), 0);
}

TEST(HandPassivityController, DissipationLeavesNoMoreThanTheLargestBalance) {
  HandPassivityController controller;
  for (int k = 0; k < 1000; ++k) {
    controller.apply(hand_at_x(0.001 * k), hand_force_x(0), kHandPassivityControllerPeriod);
    controller.set_displayed(hand_force_x(-3));
  }
  EXPECT_EQ(controller.balance_j(), HandPassivityController::kMaxBalance_j);
}

TEST(HandPassivityController, IsFiniteForAnyInputAndKeepsItsBalance) {
  HandPassivityController controller;
  controller.world_reported(0, 0, 0);
  controller.world_reported(0.5, 0, 0.1);
  const double nan = std::nan("");
  for (const double bad : {nan, kInfinity, 1e300}) {
    EXPECT_TRUE(is_finite(controller.apply(hand_at_x(0), hand_force_x(bad), kHandPassivityControllerPeriod)));
    EXPECT_TRUE(is_finite(controller.apply(hand_at_x(bad), hand_force_x(1), kHandPassivityControllerPeriod)));
    controller.lose_hand();
    controller.set_displayed(hand_force_x(bad));
  }
  EXPECT_EQ(controller.apply(hand_at_x(0), hand_force_x(1), nan).f.norm(), 0);
  EXPECT_TRUE(std::isfinite(controller.balance_j()));
}

TEST(HandPassivityController, ResetForgetsTheBalanceAndKeepsTheFigures) {
  HandPassivityController controller;
  controller.apply(hand_at_x(0), hand_force_x(-2), kHandPassivityControllerPeriod);
  controller.apply(hand_at_x(0.01), hand_force_x(-2), kHandPassivityControllerPeriod);
  ASSERT_GT(controller.balance_j(), 0);
  const double exchanged_j = controller.exchanged_j();
  controller.reset();
  EXPECT_EQ(controller.balance_j(), 0);
  EXPECT_EQ(controller.exchanged_j(), exchanged_j);
}

TEST(HandPassivityController, AllocatesNothing) {
  HandPassivityController controller;
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) {
    controller.world_reported(0.01 * k, 0, 0.001);
    controller.apply(hand_at_x(1e-4 * k), hand_force_x(3), kHandPassivityControllerPeriod);
    controller.set_displayed(hand_force_x(2));
  }
  controller.reset();
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

}  // namespace
}  // namespace tandem::haptics
