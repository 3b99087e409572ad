// Tests the forecast of a trajectory whose samples arrive late. The forecast must continue movements but not tremor,
// and must never be much worse than a zero-order hold.
#include "common/haptics/prediction/trajectory_forecast.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/base/random.hpp"

namespace tandem::haptics {
namespace {

constexpr double kTrajectoryForecastPeriod_s = 1e-3;

/// Returns the position in a minimum-jerk movement (Flash and Hogan, 1985) as a fraction of its length. `part` is the
/// elapsed fraction of its duration.
double least_jerk(double part) {
  return part * part * part * (10 - 15 * part + 6 * part * part);
}

/// Returns a path of random minimum-jerk movements and pauses, with tremor.
std::vector<Vec3> movements(std::uint64_t seed, double seconds) {
  Random random(seed);
  std::vector<Vec3> path{Vec3::Zero()};
  const auto length = static_cast<std::size_t>(seconds / kTrajectoryForecastPeriod_s);
  while (path.size() < length) {
    const Vec3 from = path.back();
    path.insert(path.end(), static_cast<std::size_t>(random.uniform(200, 1500)), from);
    const Vec3 way(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1));
    const double steps = way.norm() / random.uniform(0.03, 0.15) / kTrajectoryForecastPeriod_s;
    for (double k = 0; k < steps; ++k) path.emplace_back(from + way * least_jerk(k / steps));
  }
  for (std::size_t k = 0; k < path.size(); ++k) {
    path[k].z() += 1e-4 * std::sin(2 * std::numbers::pi * 9 * kTrajectoryForecastPeriod_s * static_cast<double>(k));
  }
  return path;
}

struct Errors {
  double forecast_m = 0;  ///< RMS error of the forecast
  double hold_m = 0;
};

Errors errors_over(const std::vector<Vec3>& path, double horizon_s, double caution) {
  TrajectoryForecast forecast(0.01, 0.25);
  const auto late = static_cast<std::size_t>(std::lround(horizon_s / kTrajectoryForecastPeriod_s));
  double forecast_square = 0, hold_square = 0;
  for (std::size_t k = late; k < path.size(); ++k) {
    const auto way = forecast.step(path[k - late], horizon_s, {}, caution, kTrajectoryForecastPeriod_s);
    forecast_square += (path[k] - path[k - late] - way.way).squaredNorm();
    hold_square += (path[k] - path[k - late]).squaredNorm();
  }
  const auto count = static_cast<double>(path.size() - late);
  return {std::sqrt(forecast_square / count), std::sqrt(hold_square / count)};
}

TEST(TrajectoryForecast, ErrsHalfAsMuchAsToHoldOverATenthOfASecondAndLessOverThreeTenths) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const std::vector<Vec3> path = movements(seed, 60);
    for (const double caution : {0.0, 1.0}) {
      const Errors at_100_ms = errors_over(path, 0.1, caution), at_300_ms = errors_over(path, 0.3, caution);
      EXPECT_LT(at_100_ms.forecast_m, (caution > 0 ? 0.6 : 0.45) * at_100_ms.hold_m) << seed << ' ' << caution;
      EXPECT_LT(at_300_ms.forecast_m, (caution > 0 ? 0.85 : 0.8) * at_300_ms.hold_m) << seed << ' ' << caution;
    }
  }
}

/// Returns a path of minimum-jerk movements along x that take 0.4 to 2 s each, with pauses of up to 0.5 s.
std::vector<double> movements_and_pauses(std::uint64_t seed, int count) {
  Random random(seed);
  std::vector<double> path{0};
  for (int i = 0; i < count; ++i) {
    const double from = path.back(), way = random.uniform(-0.15, 0.15);
    const double steps = random.uniform(0.4, 2) / kTrajectoryForecastPeriod_s;
    for (double k = 0; k < steps; ++k) path.push_back(from + way * least_jerk(k / steps));
    path.insert(path.end(), static_cast<std::size_t>(random.uniform(0, 0.5) / kTrajectoryForecastPeriod_s),
                path.back());
  }
  return path;
}

/// Returns the two coefficients that predict the change of x over the horizon from the past of x with the least squared
/// error over the whole path.
Eigen::Vector2d best_coefficients(const std::vector<double>& path, double horizon_s) {
  const double h = kTrajectoryForecastPeriod_s;
  const double fast_part = low_pass_part(TrajectoryForecast::kFast_hz, h);
  const double slow_part = low_pass_part(TrajectoryForecast::kSlow_hz, h);
  const auto steps = static_cast<std::size_t>(std::lround(horizon_s / h));
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d products = Eigen::Vector2d::Zero();
  double fast = path.front(), slow = path.front();
  for (std::size_t k = 0; k + steps < path.size(); ++k) {
    fast += fast_part * (path[k] - fast);
    slow += slow_part * (path[k] - slow);
    const Eigen::Vector2d phi = Eigen::Vector2d(fast_part * (path[k] - fast), slow_part * (path[k] - slow)) / h;
    squares += phi * phi.transpose();
    products += phi * ((path[k + steps] - path[k]) / horizon_s);
  }
  return squares.inverse() * products;
}

TEST(TrajectoryForecast, StartsWithTheOptimumForMinimumJerkMovements) {
  const std::vector<double> path = movements_and_pauses(1, 600);
  for (const double horizon_s : {0.02, 0.1, 0.2, 0.3, 0.4, 0.5}) {
    const Eigen::Vector2d best = best_coefficients(path, horizon_s);
    TrajectoryForecast forecast(0.01, 0.25);
    forecast.step(Vec3::Zero(), horizon_s, {}, 0, kTrajectoryForecastPeriod_s);
    EXPECT_LT((forecast.coefficients().head<2>() - best).norm(), 0.08) << horizon_s << ": " << best.transpose();
  }
}

TEST(TrajectoryForecast, IsHardlyWorseThanAHoldForUnpredictableMotion) {
  // The path is a random walk, whose past does not predict its future.
  Random random(7);
  std::vector<Vec3> path{Vec3::Zero()};
  for (int k = 0; k < 60000; ++k) {
    path.emplace_back(path.back() + 1e-3 * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
  }
  for (const double horizon_s : {0.05, 0.2}) {
    const Errors errors = errors_over(path, horizon_s, 0);
    EXPECT_LT(errors.forecast_m, 1.05 * errors.hold_m) << horizon_s;
  }
}

TEST(TrajectoryForecast, LearnsWhetherItGoesAlong) {
  const auto share_of_along = [](bool goes_along) {
    TrajectoryForecast forecast(0.01, 0.25);
    const std::vector<Vec3> path = movements(11, 30);
    for (std::size_t k = 200; k < path.size(); ++k) {
      const Vec3 known = goes_along ? path[k - 200] : Vec3(Vec3::Zero());
      forecast.step(known, 0.2, {path[k] - path[k - 200], Vec3::Zero()}, 1, kTrajectoryForecastPeriod_s);
    }
    return forecast.coefficients()[2];
  };
  EXPECT_GT(share_of_along(true), 0.35);
  EXPECT_LT(share_of_along(false), 0.15);
}

TEST(TrajectoryForecast, AtRestItHoldsAndForFiniteInputItIsFinite) {
  TrajectoryForecast forecast(0.01, 0.25);
  for (int k = 0; k < 3000; ++k) forecast.step({0.1, 0.2, 0.3}, 0.1, {}, 0, kTrajectoryForecastPeriod_s);
  EXPECT_EQ(forecast.step({0.1, 0.2, 0.3}, 0.1, {}, 0, kTrajectoryForecastPeriod_s).way.norm(), 0);
  Random random(3);
  const auto any = [&random] {
    return Vec3(random.uniform(-1e3, 1e3), random.uniform(-1e3, 1e3), random.uniform(-1e3, 1e3));
  };
  for (int k = 0; k < 3000; ++k) {
    const double caution = k % 2;
    const auto way = forecast.step(any(), random.uniform(0, 2), {any(), any()}, caution, kTrajectoryForecastPeriod_s);
    ASSERT_TRUE(way.way.allFinite() && way.velocity.allFinite()) << k;
    ASSERT_GE(forecast.share(), 0);
    ASSERT_LE(forecast.share(), TrajectoryForecast::kMaxShare);
  }
}

}  // namespace
}  // namespace tandem::haptics
