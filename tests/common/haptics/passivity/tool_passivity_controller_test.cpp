// Tests tools whose hand supplies the energy that the tool transfers to the world, and tools whose hand does not.
#include "common/haptics/passivity/tool_passivity_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/allocation_counter.hpp"

namespace tandem::haptics {
namespace {

constexpr double kStep = 0.001;
/// Bound of the energy created in a push of five seconds. It is the sum of three parts:
/// - the magnitude of the negative balance at which the brake is firm
/// - the leak in five seconds
/// - the work of 6 N at 0.1 m/s in the time in which the brake dissipates a negative balance
constexpr double kMaxCreated_j = -ToolPassivityController::kMinBalance_j + 5 * ToolPassivityController::kLeakRate_w +
                                 6 * 0.1 * ToolPassivityController::kPayBack_s;

/// A coupling with at most 6 N drags a body of 0.5 kg along x against a damper. The coupling's target moves at 0.1 m/s.
/// The integration is implicit, as in the world.
struct PushedBody {
  /// Runs some steps. The hand reports the fraction `supplied_share` of the work on the world, `report_delay` steps
  /// late.
  void run(int steps, double supplied_share, int report_delay) {
    std::vector<double> supplied;
    for (int k = 0; k < steps; ++k) {
      const double brake = controller.brake_n_s_per_m(kStep);
      const double target = 0.1 * kStep * k;
      const double spring = std::clamp(300 * (target - x), -6.0, 6.0);
      v = (0.5 * v + kStep * spring) / (0.5 + kStep * (3 + brake + 20));
      const double f = spring - (3 + brake) * v;
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

TEST(ToolPassivityController, AToolWithoutSuppliedEnergyIsBrakedToAStandstill) {
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

TEST(ToolPassivityController, TheEnergyInTheWorldHardlyExceedsTheSupply) {
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
  for (int i = 0; i < 26000; ++i) controller.brake_n_s_per_m(kStep);
  EXPECT_EQ(controller.balance_j(), 0);
  controller.hand_reported(0, 10, kStep);
  controller.restart_handle(0.2);
  EXPECT_NEAR(controller.balance_j(), 0.2, 1e-12) << "the energy stored in the coupling must be credited";
}

// A tool without contact must not be braked. Its brake could recover no energy, and the tool would be stuck in the air
// for seconds after its balance was used up.
TEST(ToolPassivityController, AToolWithoutContactIsNotBraked) {
  ToolPassivityController controller;
  controller.hand_reported(0, 0, 0);
  controller.hand_reported(0, 5, kStep);
  for (int i = 0; i < 100; ++i) controller.brake_n_s_per_m(kStep);
  EXPECT_NEAR(controller.brake_n_s_per_m(kStep), ToolPassivityController::kFirmBrake_n_s_per_m, 50);
  for (int i = 0; i < 600; ++i) controller.brake_n_s_per_m(kStep, false);
  EXPECT_EQ(controller.brake_n_s_per_m(kStep, false), 0);
  for (int i = 0; i < 10; ++i) controller.brake_n_s_per_m(kStep);
  EXPECT_GT(controller.brake_n_s_per_m(kStep), 1000) << "as soon as it touches something";
}

TEST(ToolPassivityController, OnlyTheMissingEnergyIsDissipated) {
  // The tool lifts with 2 N at 0.1 m/s, but the hand reports a supply of only 1.7 N at this speed. This happens if the
  // client's model is 15 % too light.
  ToolPassivityController controller;
  controller.hand_reported(0, 0, 0);
  double into_j = 0, brake = 0;
  for (int k = 1; k <= 3000; ++k) {
    brake = controller.brake_n_s_per_m(kStep);
    into_j += (2 - brake * 0.1) * 0.1 * kStep;
    controller.stepped({Vec3(1e-4 * k, 0, 0), Quat::Identity()}, {Vec3(2 - brake * 0.1, 0, 0), Vec3::Zero()}, into_j);
    controller.hand_reported(1.7 * 0.1 * kStep * k, 0, kStep);
  }
  EXPECT_NEAR(brake * 0.1, 0.3, 0.05) << "the brake must balance the excess of 0.3 N";
  for (int k = 0; k < 200; ++k) {
    controller.stepped({Vec3(0.3, 0, 0), Quat::Identity()}, {Vec3(2, 0, 0), Vec3::Zero()}, into_j);
    controller.hand_reported(1.7 * 0.3 + into_j, 0, kStep);
    brake = controller.brake_n_s_per_m(kStep);
  }
  EXPECT_EQ(brake, 0) << "paid";
}

TEST(ToolPassivityController, IsFiniteAndWithinItsBoundsForAnyInput) {
  ToolPassivityController controller;
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), infinity, 1e300}) {
    controller.stepped({Vec3(bad, 0, 0), Quat::Identity()}, {Vec3(bad, 0, 0), Vec3::Zero()}, bad);
    controller.stepped({}, {Vec3(bad, 0, 0), Vec3::Zero()}, -bad);
    for (const double step : {bad, kStep}) {
      const double brake = controller.brake_n_s_per_m(step);
      EXPECT_TRUE(brake >= 0 && brake <= ToolPassivityController::kFirmBrake_n_s_per_m) << brake;
    }
  }
}

TEST(ToolPassivityController, AllocatesNothing) {
  ToolPassivityController controller;
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) {
    controller.hand_reported(0.01 * k, 0, kStep);
    controller.stepped({Vec3(1e-4 * k, 0, 0), Quat::Identity()}, {Vec3(1, 0, 0), Vec3::Zero()}, 0.01 * k);
    controller.brake_n_s_per_m(kStep);
  }
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

}  // namespace
}  // namespace tandem::haptics
