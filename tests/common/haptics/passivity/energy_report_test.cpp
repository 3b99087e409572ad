// Tests the reader of a peer's energy sums. Lost reports must have no effect, and false values only a bounded effect.
#include "common/haptics/passivity/energy_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tandem::haptics {
namespace {

TEST(EnergyReport, GivesTheNetChangeSinceTheReportBefore) {
  EnergyReport report;
  EXPECT_EQ(report.accept(7, 3, 0), 0) << "the first only sets where to count from";
  EXPECT_NEAR(report.accept(7.5, 3.1, 0.1), 0.4, 1e-12);
  EXPECT_NEAR(report.accept(7.5, 3.4, 0.1), -0.3, 1e-12);
}

TEST(EnergyReport, ReportsThatArriveInABunchCountWhole) {
  EnergyReport report;
  report.accept(0, 0, 0);
  double sum_j = 0;
  // The peer reports a power of 2 W for one second. Its reports arrive in groups of ten, 0.1 ms apart.
  for (int k = 1; k <= 200; ++k) sum_j += report.accept(0.005 * 2 * k, 0, k % 10 == 0 ? 0.05 : 1e-4);
  EXPECT_NEAR(sum_j, 2, 1e-9);
}

TEST(EnergyReport, FalseEnergyCountsWithinThePowerLimitOnly) {
  EnergyReport report(5);
  report.accept(0, 0, 0);
  EXPECT_LE(report.accept(1e6, 0, 0.1), 5 * 1.0) << "a second's worth at once";
  double sum_j = 0;
  for (int k = 1; k <= 20; ++k) sum_j += report.accept(1e6 + 1e5 * k, 0, 0.1);
  EXPECT_LE(sum_j, 5 * 2.0 + 1e-9);
}

TEST(EnergyReport, AnImpossibleAmountOfWorkDoesNotCount) {
  EnergyReport report;
  report.accept(0, 0, 0, 0);
  double claimed_j = 0, taken_j = 0;
  for (int ms = 1; ms <= 1000; ++ms) taken_j += report.accept(claimed_j += 0.01, 0, 0.001, 0.0);
  EXPECT_NEAR(taken_j, EnergyReport::kMaxUnclaimed_j, 1e-12) << "10 W for a hand that does not move";
  for (int ms = 1; ms <= 1000; ++ms) taken_j += report.accept(claimed_j += 0.002, 0, 0.001, 0.004);
  EXPECT_NEAR(taken_j, EnergyReport::kMaxUnclaimed_j + 2, 1e-12) << "possible work must count completely";
  EXPECT_NEAR(report.accept(claimed_j + 10, 0, 0.001, 3), 3 + EnergyReport::kMaxUnclaimed_j, 1e-12)
      << "also if reports arrive late together";
}

TEST(EnergyReport, ASumThatFallsOrIsNotFiniteIsDroppedWholeAndCounted) {
  EnergyReport report;
  report.accept(1, 1, 0);
  for (const double bad : {0.5, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_EQ(report.accept(bad, 2, 0.005), 0);
    EXPECT_EQ(report.accept(2, bad, 0.005), 0);
  }
  EXPECT_EQ(report.dropped(), 8U);
  EXPECT_NEAR(report.accept(1.2, 1.1, 0.1), 0.1, 1e-12) << "counted from the last sound one";
}

}  // namespace
}  // namespace tandem::haptics
