#include "common/haptics/velocity_estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "common/base/random.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::haptics {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr double kVelocityEstimatorStep = 3e-5;  // m; resolution of a medium desktop device
constexpr double kVelocityEstimatorPeriod = 1e-3;

double rounded(double a, double step) {
  return std::round(a / step) * step;
}
Pose at_x(double x) {
  return {Vec3(x, 0, 0), Quat::Identity()};
}
Pose turned_z(double angle) {
  return {Vec3::Zero(), quaternion_of(Vec3(0, 0, angle))};
}
LocalTime tick(int k) {
  return LocalTime(milliseconds(k));
}
VelocityEstimator quantised() {
  return VelocityEstimator(kVelocityEstimatorStep, 1e-3);
}

TEST(VelocityEstimator, OfExactPositionsIsTheLastPeriodsDifference) {
  VelocityEstimator estimator;
  EXPECT_EQ(estimator.add(tick(0), at_x(1)).v.norm(), 0);
  EXPECT_NEAR(estimator.add(tick(1), at_x(1.001)).v.x(), 1, 1e-9);
  EXPECT_NEAR(estimator.add(tick(2), at_x(1.000)).v.x(), -1, 1e-9);
  EXPECT_EQ(estimator.linear_delay(), Duration(microseconds(500)));
}

TEST(VelocityEstimator, SteadyMotionIsEstimatedWithinTheResolution) {
  // Bound of the error of the estimated velocity, the slope of a line that is fitted to a full window.
  // - The window has 21 samples at the times t_i with the period T. Their mean is t̄.
  // - Each position may be wrong by half an encoder step.
  // - The error is at most Σ|t_i − t̄| step/2 / Σ(t_i − t̄)² = 110 step/2 / (770 T).
  const double bound = 110 * kVelocityEstimatorStep / 2 / (770 * kVelocityEstimatorPeriod);
  for (const double speed : {0.0, 0.001, 0.003, 0.01, 0.037, 0.1, 0.3, 1.0}) {
    VelocityEstimator estimator = quantised();
    for (int k = 0; k < 300; ++k) {
      const Twist found =
          estimator.add(tick(k), at_x(rounded(0.1234 + speed * k * kVelocityEstimatorPeriod, kVelocityEstimatorStep)));
      if (k < 20) continue;
      ASSERT_NEAR(found.v.x(), speed, bound) << speed << " m/s, tick " << k;
      ASSERT_EQ(estimator.linear_delay(), Duration(milliseconds(10)));
    }
  }
}

TEST(VelocityEstimator, SteadyRotationIsEstimatedWithinTheResolution) {
  const double step = 1e-3;
  const double bound = 110 * step / 2 / (770 * kVelocityEstimatorPeriod);
  for (const double speed : {0.05, 1.0, 7.0, -40.0}) {
    VelocityEstimator estimator = quantised();
    for (int k = 0; k < 300; ++k) {
      const Twist found = estimator.add(tick(k), turned_z(rounded(0.2 + speed * k * kVelocityEstimatorPeriod, step)));
      if (k >= 20) {
        ASSERT_NEAR(found.w.z(), speed, bound + 1e-9) << speed << " rad/s, tick " << k;
      }
    }
  }
}

TEST(VelocityEstimator, IsQuietAtRestOnTheEdgeOfAStep) {
  // The reported position alternates randomly between two neighbouring values. A difference over one period would be
  // ±30 mm/s.
  Random random(11, 0);
  VelocityEstimator estimator = quantised();
  double square = 0, largest = 0;
  constexpr int kTicks = 5000;
  for (int k = 0; k < kTicks; ++k) {
    const double speed = estimator.add(tick(k), at_x(random.uniform() < 0.5 ? 0 : kVelocityEstimatorStep)).v.x();
    if (k < 20) continue;
    square += speed * speed;
    largest = std::max(largest, std::abs(speed));
  }
  // Independent position errors of ±step/2 give the fitted slope a standard deviation of step/2 / (T √770) = 0.54 mm/s.
  // 770 T² is the sum of the squared times of the window, relative to their mean.
  const double deviation = kVelocityEstimatorStep / 2 / (kVelocityEstimatorPeriod * std::sqrt(770.0));
  EXPECT_NEAR(std::sqrt(square / (kTicks - 20)), deviation, 0.15 * deviation) << "seed 11";
  EXPECT_LT(largest, 110 * kVelocityEstimatorStep / 2 / (770 * kVelocityEstimatorPeriod) + 1e-12);
}

TEST(VelocityEstimator, FollowsASuddenStartWithinItsStatedDelay) {
  VelocityEstimator estimator = quantised();
  const double acceleration = 20;
  for (int k = 0; k < 100; ++k) estimator.add(tick(k), at_x(0));
  for (int k = 1; k <= 40; ++k) {
    const double t = k * kVelocityEstimatorPeriod;
    const double found =
        estimator.add(tick(100 + k), at_x(rounded(acceleration * t * t / 2, kVelocityEstimatorStep))).v.x();
    // The estimate lags by the stated delay, so it must equal the velocity at that earlier time. The tolerance allows
    // for the encoder's resolution at both ends of the window.
    const double delay = to_seconds(estimator.linear_delay());
    const double then = acceleration * std::max(0.0, t - delay);
    ASSERT_NEAR(found, then, 1.5 * kVelocityEstimatorStep / (2 * delay) + acceleration * kVelocityEstimatorPeriod) << k;
  }
  // With the acceleration a, a line that is fitted to a window of the duration w deviates from the motion by a w²/12 at
  // the window's ends. The estimator allows a deviation of one encoder step. The window must therefore shrink to √(12
  // step / a) = 4 ms or less.
  EXPECT_LE(estimator.linear_delay(), Duration(milliseconds(3)));
}

/// Returns the lag of `late` relative to `now`: the time shift with the largest correlation over whole periods. It is
/// interpolated to a fraction of a sample.
double lag_of(const std::vector<double>& now, const std::vector<double>& late) {
  const auto correlation = [&](int shift) {
    double sum = 0;
    for (std::size_t i = 1000; i < now.size(); ++i) sum += late[i] * now[i - static_cast<std::size_t>(shift)];
    return sum;
  };
  int best = 0;
  for (int shift = 0; shift < 60; ++shift) {
    if (correlation(shift) > correlation(best)) best = shift;
  }
  if (best == 0) return 0;
  const double before = correlation(best - 1), at = correlation(best), after = correlation(best + 1);
  return best + 0.5 * (before - after) / (before - 2 * at + after);
}

TEST(VelocityEstimator, HasItsStatedLatency) {
  for (const double frequency : {1.0, 3.0, 8.0}) {
    for (const double amplitude : {5e-4, 5e-3, 2e-2}) {
      VelocityEstimator estimator = quantised();
      const double omega = 2 * std::numbers::pi * frequency;
      std::vector<double> real, found;
      double delay = 0, weight = 0;
      for (int k = 0; k < 4000; ++k) {
        const double t = k * kVelocityEstimatorPeriod;
        found.push_back(
            estimator.add(tick(k), at_x(rounded(amplitude * std::sin(omega * t), kVelocityEstimatorStep))).v.x());
        real.push_back(amplitude * omega * std::cos(omega * t));
        // Averages the stated delay. Its weight is the squared slope of the velocity, because a lag is visible where
        // the velocity changes fast.
        const double slope = std::abs(std::sin(omega * t));
        delay += slope * slope * to_seconds(estimator.linear_delay());
        weight += slope * slope;
      }
      EXPECT_NEAR(lag_of(real, found), delay / weight / kVelocityEstimatorPeriod, 1.0)
          << frequency << " Hz, " << amplitude << " m";
    }
  }
}

TEST(VelocityEstimator, UsesTheActualUnevenTimes) {
  Random random(13, 0);
  VelocityEstimator estimator = quantised();
  double t = 0;
  for (int k = 0; k < 200; ++k) {
    t += random.uniform(2e-4, 3e-3);
    const Twist found = estimator.add(LocalTime{} + from_seconds(t), at_x(rounded(0.2 * t, kVelocityEstimatorStep)));
    if (k > 20) {
      ASSERT_NEAR(found.v.x(), 0.2, 0.003) << "seed 13, sample " << k;
    }
  }
}

TEST(VelocityEstimator, IgnoresSamplesThatAreNotNewerOrNotFinite) {
  VelocityEstimator estimator = quantised();
  Twist last;
  for (int k = 0; k < 50; ++k) last = estimator.add(tick(k), at_x(k * kVelocityEstimatorStep));
  const Duration delay = estimator.linear_delay();
  const auto unchanged = [&](LocalTime taken, const Pose& X) {
    const Twist found = estimator.add(taken, X);
    return found.v == last.v && found.w == last.w && estimator.linear_delay() == delay;
  };
  EXPECT_TRUE(unchanged(tick(49), at_x(1)));
  EXPECT_TRUE(unchanged(tick(10), at_x(1)));
  EXPECT_TRUE(unchanged(tick(51), at_x(std::nan(""))));
  EXPECT_TRUE(unchanged(tick(51), at_x(std::numeric_limits<double>::infinity())));
  EXPECT_TRUE(unchanged(tick(51), {Vec3::Zero(), Quat(std::nan(""), 0, 0, 1)}));
  EXPECT_NEAR(estimator.add(tick(50), at_x(50 * kVelocityEstimatorStep)).v.x(),
              kVelocityEstimatorStep / kVelocityEstimatorPeriod, 1e-9);
}

TEST(VelocityEstimator, IsFiniteForPositionsAtTheEndOfTheNumberRange) {
  VelocityEstimator estimator = quantised();
  for (int k = 0; k < 60; ++k) {
    EXPECT_TRUE(is_finite(estimator.add(tick(k), at_x(k % 2 == 0 ? 1e308 : -1e308)))) << k;
  }
}

TEST(VelocityEstimator, StartsAnewAfterReset) {
  VelocityEstimator estimator = quantised();
  for (int k = 0; k < 50; ++k) estimator.add(tick(k), at_x(k * 1e-3));
  estimator.reset();
  EXPECT_EQ(estimator.add(tick(60), at_x(5)).v.norm(), 0);
  EXPECT_EQ(estimator.linear_delay(), Duration(0));
  EXPECT_EQ(estimator.add(tick(61), at_x(5)).v.norm(), 0);
}

TEST(VelocityEstimator, AllocatesNothing) {
  VelocityEstimator estimator = quantised();
  const std::uint64_t before = test::allocation_count();
  for (int k = 0; k < 100; ++k) estimator.add(tick(k), at_x(k * 1e-4));
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace tandem::haptics
