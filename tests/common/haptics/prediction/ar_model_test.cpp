#include "common/haptics/prediction/ar_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "common/base/random.hpp"

namespace tandem::haptics {
namespace {

constexpr std::array kFits{ArFit::kYuleWalker, ArFit::kLeastSquares, ArFit::kBurg};

/// Returns a random series x_t = φ_1 x_{t−1} + φ_2 x_{t−2} + noise.
std::vector<double> second_order_series(double phi1, double phi2, double noise, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> x{random.normal(), random.normal()};
  while (x.size() < count) {
    x.push_back(phi1 * x[x.size() - 1] + phi2 * x[x.size() - 2] + noise * random.normal());
  }
  return x;
}

/// Returns the largest magnitude of a root of z^p − Σ φ_i z^(p−i). The roots are computed as eigenvalues of the
/// companion matrix.
double largest_root(std::span<const double> phi) {
  const auto p = static_cast<Eigen::Index>(phi.size());
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(p, p);
  for (Eigen::Index i = 0; i < p; ++i) companion(0, i) = phi[static_cast<std::size_t>(i)];
  for (Eigen::Index i = 1; i < p; ++i) companion(i, i - 1) = 1;
  return companion.eigenvalues().cwiseAbs().maxCoeff();
}

TEST(ArModel, EveryFitRecoversTheSeriesThatAModelMade) {
  const std::vector<double> x = second_order_series(1.5, -0.8, 0.1, 4000, 3);
  for (const ArFit fit : kFits) {
    const ArModel model = fit_ar(x, 2, fit, false);
    // The tolerance is four standard deviations of the estimate, √((1 − φ_2²)/N) = 0.0095 each.
    EXPECT_NEAR(model.phi[0], 1.5, 0.038) << name_of(fit);
    EXPECT_NEAR(model.phi[1], -0.8, 0.038) << name_of(fit);
    // The standard deviation of the estimated variance V is V √(2/N).
    EXPECT_NEAR(model.error_variance, 0.01, 4 * 0.01 * std::sqrt(2.0 / 4000)) << name_of(fit);
  }
}

TEST(ArModel, LeastSquaresAndBurgPredictANoiselessSinusoidToTheEnd) {
  const auto sine = [](double t) { return 2.0 * std::sin(0.21 * t + 0.4); };
  std::vector<double> x;
  for (int t = 0; t < 300; ++t) x.push_back(sine(t));
  for (const ArFit fit : {ArFit::kLeastSquares, ArFit::kBurg}) {
    const ArModel model = fit_ar(x, 2, fit, false);
    std::array<double, 2> newest{x[299], x[298]};
    for (int t = 300; t < 310; ++t) {
      const double next = model.next(newest);
      // The tolerance increases by 0.02 per predicted step, for two errors. The roots are limited to 0.999, and Burg's
      // estimate for a sinusoid depends on the phase by about 1/N.
      EXPECT_NEAR(next, sine(t), 0.02 * (t - 298)) << name_of(fit);
      newest = {next, newest[0]};
    }
  }
}

TEST(ArModel, LevinsonSolvesTheSameAsElimination) {
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    // The autocovariances of a random series give a positive definite matrix.
    std::vector<double> x(200);
    double before = 0;
    for (double& value : x) value = before = 0.7 * before + random.normal();
    constexpr std::size_t kOrder = 6;
    std::array<double, kOrder + 1> r{};
    for (std::size_t k = 0; k <= kOrder; ++k) {
      for (std::size_t t = k; t < x.size(); ++t) r[k] += x[t] * x[t - k];
    }
    Eigen::MatrixXd toeplitz(kOrder, kOrder);
    Eigen::VectorXd right(kOrder);
    for (int i = 0; i < static_cast<int>(kOrder); ++i) {
      right[i] = r[static_cast<std::size_t>(i) + 1];
      for (int j = 0; j < static_cast<int>(kOrder); ++j) toeplitz(i, j) = r[static_cast<std::size_t>(std::abs(i - j))];
    }
    const Eigen::VectorXd direct = toeplitz.fullPivLu().solve(right);
    std::array<double, kOrder> phi{};
    double variance = 0;
    ASSERT_TRUE(levinson(r, phi, variance));
    for (std::size_t i = 0; i < kOrder; ++i) EXPECT_NEAR(phi[i], direct[static_cast<Eigen::Index>(i)], 1e-10);
    EXPECT_NEAR(variance, r[0] - right.dot(direct), 1e-9 * r[0]);
  }
}

TEST(ArModel, StabilityIsThatOfTheRoots) {
  Random random(11);
  int stable = 0;
  for (int trial = 0; trial < 500; ++trial) {
    std::array<double, 4> phi{};
    for (double& value : phi) value = random.uniform(-1.2, 1.2);
    const double root = largest_root(phi);
    if (std::abs(root - 1) < 1e-6) continue;
    EXPECT_EQ(is_stable(phi), root < 1) << root;
    stable += root < 1 ? 1 : 0;
    make_stable(phi, kMaxArRadius);
    EXPECT_LE(largest_root(phi), kMaxArRadius + 1e-6);
  }
  EXPECT_GT(stable, 25);
  EXPECT_LT(stable, 475);
}

TEST(ArModel, AStableModelIsUnchanged) {
  std::array<double, 2> phi{1.5, -0.8};
  make_stable(phi, kMaxArRadius);
  EXPECT_EQ(phi[0], 1.5);
  EXPECT_EQ(phi[1], -0.8);
}

TEST(ArModel, EveryFitOfAGrowingSeriesIsStable) {
  // The series has a root at 1.1. A least-squares fit finds this root, but must then be stabilised.
  std::vector<double> x;
  for (int t = 0; t < 60; ++t) x.push_back(std::pow(1.1, t));
  for (const ArFit fit : kFits) {
    const ArModel model = fit_ar(x, 3, fit, false);
    ASSERT_EQ(model.order, 3U) << name_of(fit);
    EXPECT_LT(largest_root(std::span(model.phi).first(3)), 1.0) << name_of(fit);
  }
}

TEST(ArModel, FitsOfBadSeriesAreFiniteAndPredictTheMean) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<std::vector<double>> bad{
      {}, {1.0}, std::vector<double>(8, 2.0), std::vector<double>(300, 0.0), std::vector<double>(300, 0.1)};
  bad.emplace_back(300, 1.0);
  bad.back()[100] = kNan;
  bad.emplace_back(300, 1.0);
  bad.back()[5] = -kInfinite;
  bad.emplace_back(300, 1e308);
  bad.back()[7] = -1e308;
  for (const auto& series : bad) {
    for (const ArFit fit : kFits) {
      const ArModel model = fit_ar(series, 5, fit, true);
      EXPECT_EQ(model.order, 0U);
      EXPECT_TRUE(std::isfinite(model.mean));
      EXPECT_EQ(model.next({}), model.mean);
    }
  }
  EXPECT_NEAR(fit_ar(bad[4], 5, ArFit::kBurg, true).mean, 0.1, 1e-12);
}

TEST(FinalPredictionError, FindsTheOrderThatMadeTheSeries) {
  for (const ArFit fit : kFits) {
    const auto orders = fpe_of_orders(second_order_series(1.2, -0.7, 1, 3000, 5), 10, fit, true);
    ASSERT_EQ(orders.size(), 11U);
    // FPE (final prediction error) does not find the true order exactly. For any N it may select too high an order, but
    // hardly ever too low an order. Higher orders reduce the FPE only slightly.
    const std::size_t best = best_order(orders);
    EXPECT_GE(best, 2U);
    EXPECT_LT(orders[2].fpe, 1.01 * orders[best].fpe);
    EXPECT_GT(orders[1].fpe, 1.5 * orders[2].fpe);
  }
}

TEST(FinalPredictionError, IsAkaikesOfTheVariance) {
  const std::vector<double> x = second_order_series(0.5, 0.2, 1, 500, 9);
  for (const ArOrder& row : fpe_of_orders(x, 6, ArFit::kBurg, true)) {
    const double d = static_cast<double>(row.order) / 500;
    EXPECT_NEAR(row.fpe, row.error_variance * (1 + d) / (1 - d), 1e-12);
  }
  EXPECT_THROW(best_order(fpe_of_orders({}, 5, ArFit::kBurg, true)), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::haptics
