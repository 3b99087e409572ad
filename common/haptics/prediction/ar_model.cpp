#include "common/haptics/prediction/ar_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace tandem::haptics {
namespace {

/// Relative ridge that makes the normal equations of a noise-free series solvable (our choice).
constexpr double kRidge = 1e-9;
/// Relative variation below which a series counts as constant. Smaller variations are rounding errors.
constexpr double kMinVariation = 1e-12;

double mean_of_finite(std::span<const double> series) {
  double sum = 0;
  std::size_t count = 0;
  for (const double x : series) {
    if (!std::isfinite(x)) continue;
    sum += x;
    ++count;
  }
  return count == 0 || !std::isfinite(sum) ? 0 : sum / static_cast<double>(count);
}

/// Returns the power of x − mean; 0 if it is only rounding error, NaN if the series is not finite.
double power_about(std::span<const double> series, double mean) {
  double power = 0, largest = 0;
  for (const double x : series) {
    power += (x - mean) * (x - mean);
    largest = std::max(largest, std::abs(x));
  }
  power /= static_cast<double>(series.size());
  return std::sqrt(power) <= kMinVariation * largest ? 0 : power;
}

bool fit_yule_walker(std::span<const double> series, ArModel& model) {
  std::array<double, kMaxArOrder + 1> r{};
  for (std::size_t k = 0; k <= model.order; ++k) {
    for (std::size_t t = k; t < series.size(); ++t) r[k] += (series[t] - model.mean) * (series[t - k] - model.mean);
    r[k] /= static_cast<double>(series.size());
  }
  return levinson(std::span(r).first(model.order + 1), std::span(model.phi).first(model.order), model.error_variance);
}

using Matrix = std::array<std::array<double, kMaxArOrder>, kMaxArOrder>;
using Vector = std::array<double, kMaxArOrder>;

/// Solves A x = b in place by Cholesky decomposition. Returns false if A is not positive definite.
bool solve_symmetric(Matrix& a, Vector& b, std::size_t n) {
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < j; ++k) {
      for (std::size_t i = j; i < n; ++i) a[i][j] -= a[i][k] * a[j][k];
    }
    // This comparison is false for NaN, too.
    if (!(a[j][j] > 0)) return false;
    const double root = std::sqrt(a[j][j]);
    for (std::size_t i = j; i < n; ++i) a[i][j] /= root;
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return true;
}

/// Returns the mean square of the one-step error over t ≥ p.
double error_variance_of(std::span<const double> series, const ArModel& model) {
  double sum = 0;
  for (std::size_t t = model.order; t < series.size(); ++t) {
    double predicted = model.mean;
    for (std::size_t i = 0; i < model.order; ++i) predicted += model.phi[i] * (series[t - 1 - i] - model.mean);
    sum += (series[t] - predicted) * (series[t] - predicted);
  }
  return sum / static_cast<double>(series.size() - model.order);
}

bool fit_least_squares(std::span<const double> series, ArModel& model) {
  const std::size_t p = model.order;
  Matrix a{};
  Vector b{};
  for (std::size_t t = p; t < series.size(); ++t) {
    for (std::size_t i = 0; i < p; ++i) {
      const double lag = series[t - 1 - i] - model.mean;
      b[i] += lag * (series[t] - model.mean);
      for (std::size_t j = 0; j <= i; ++j) a[i][j] += lag * (series[t - 1 - j] - model.mean);
    }
  }
  double trace = 0;
  for (std::size_t i = 0; i < p; ++i) trace += a[i][i];
  for (std::size_t i = 0; i < p; ++i) a[i][i] += kRidge * trace;
  if (!solve_symmetric(a, b, p)) return false;
  model.phi = b;
  make_stable(std::span(model.phi).first(p), kMaxArRadius);
  model.error_variance = error_variance_of(series, model);
  return true;
}

bool fit_burg(std::span<const double> series, ArModel& model) {
  const std::size_t n = series.size();
  std::vector<double> forward(n), backward(n);
  double variance = 0;
  for (std::size_t t = 0; t < n; ++t) {
    forward[t] = backward[t] = series[t] - model.mean;
    variance += forward[t] * forward[t] / static_cast<double>(n);
  }
  for (std::size_t m = 0; m < model.order; ++m) {
    double numerator = 0, denominator = 0;
    for (std::size_t t = m + 1; t < n; ++t) {
      numerator += forward[t] * backward[t - 1];
      denominator += forward[t] * forward[t] + backward[t - 1] * backward[t - 1];
    }
    if (!(denominator > 0)) break;
    const double k = std::clamp(2 * numerator / denominator, -kMaxArRadius, kMaxArRadius);
    const Vector before = model.phi;
    model.phi[m] = k;
    for (std::size_t i = 0; i < m; ++i) model.phi[i] = before[i] - k * before[m - 1 - i];
    for (std::size_t t = n - 1; t > m; --t) {
      const double f = forward[t];
      forward[t] = f - k * backward[t - 1];
      backward[t] = backward[t - 1] - k * f;
    }
    variance *= 1 - k * k;
  }
  model.error_variance = variance;
  return true;
}

bool is_finite(const ArModel& model) {
  return std::ranges::all_of(model.phi, [](double phi) { return std::isfinite(phi); }) &&
         std::isfinite(model.error_variance);
}

}  // namespace

std::string_view name_of(ArFit fit) {
  switch (fit) {
    case ArFit::kYuleWalker:
      return "yule-walker";
    case ArFit::kLeastSquares:
      return "least-squares";
    case ArFit::kBurg:
      return "burg";
  }
  return {};
}

double ArModel::next(std::span<const double> newest_first) const noexcept {
  double predicted = mean;
  for (std::size_t i = 0; i < order; ++i) predicted += phi[i] * (newest_first[i] - mean);
  return predicted;
}

ArModel fit_ar(std::span<const double> series, std::size_t order, ArFit fit, bool takes_mean) {
  order = std::min(order, kMaxArOrder);
  const double mean = mean_of_finite(series);
  ArModel model;
  model.mean = takes_mean ? mean : 0;
  const double power = series.empty() ? 0 : power_about(series, model.mean);
  const ArModel fallback{0, {}, mean, std::isfinite(power) ? power : 0};
  if (series.size() <= 2 * order || !(power > 0) || !std::isfinite(power)) return fallback;
  model.order = order;
  bool is_fitted = false;
  if (fit == ArFit::kYuleWalker) is_fitted = fit_yule_walker(series, model);
  if (fit == ArFit::kLeastSquares) is_fitted = fit_least_squares(series, model);
  if (fit == ArFit::kBurg) is_fitted = fit_burg(series, model);
  return is_fitted && is_finite(model) ? model : fallback;
}

bool levinson(std::span<const double> r, std::span<double> phi, double& error_variance) noexcept {
  std::ranges::fill(phi, 0.0);
  error_variance = r[0];
  for (std::size_t m = 0; m < phi.size(); ++m) {
    if (!(error_variance > 0)) return false;
    double k = r[m + 1];
    for (std::size_t i = 0; i < m; ++i) k -= phi[i] * r[m - i];
    k /= error_variance;
    if (!(std::abs(k) < 1)) return false;
    // φ_i and φ_{m−1−i} depend on each other's old value, so each pair is updated together.
    for (std::size_t i = 0; i < m / 2; ++i) {
      const double a = phi[i], b = phi[m - 1 - i];
      phi[i] = a - k * b;
      phi[m - 1 - i] = b - k * a;
    }
    if (m % 2 == 1) phi[m / 2] -= k * phi[m / 2];
    phi[m] = k;
    error_variance *= 1 - k * k;
  }
  return true;
}

bool is_stable(std::span<const double> phi, double radius) noexcept {
  if (phi.size() > kMaxArOrder) return false;
  Vector a{};
  double scale = 1;
  for (std::size_t i = 0; i < phi.size(); ++i) a[i] = phi[i] / (scale *= radius);
  for (std::size_t m = phi.size(); m-- > 0;) {
    const double k = a[m];
    if (!(std::abs(k) < 1)) return false;
    const Vector before = a;
    for (std::size_t i = 0; i < m; ++i) a[i] = (before[i] + k * before[m - 1 - i]) / (1 - k * k);
  }
  return true;
}

void make_stable(std::span<double> phi, double radius) noexcept {
  if (is_stable(phi, radius)) return;
  const auto scaled = [&](double gamma) {
    Vector a{};
    double power = 1;
    for (std::size_t i = 0; i < phi.size(); ++i) a[i] = phi[i] * (power *= gamma);
    return a;
  };
  double low = 0, high = 1;
  constexpr int kHalvings = 40;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const Vector tried = scaled(middle);
    (is_stable(std::span(tried).first(phi.size()), radius) ? low : high) = middle;
  }
  const Vector found = scaled(low);
  std::ranges::copy_n(found.begin(), static_cast<std::ptrdiff_t>(phi.size()), phi.begin());
}

std::vector<ArOrder> fpe_of_orders(std::span<const double> series, std::size_t most_order, ArFit fit, bool takes_mean) {
  std::vector<ArOrder> orders;
  const auto samples = static_cast<double>(series.size());
  for (std::size_t order = 0; order <= std::min(most_order, kMaxArOrder) && series.size() > 2 * order; ++order) {
    const ArModel model = fit_ar(series, order, fit, takes_mean);
    if (model.order != order) break;
    const auto d = static_cast<double>(order);
    orders.push_back({order, model.error_variance, model.error_variance * (1 + d / samples) / (1 - d / samples)});
  }
  return orders;
}

std::size_t best_order(std::span<const ArOrder> orders) {
  if (orders.empty()) throw std::invalid_argument("no order to choose from: the series is too short or constant");
  return std::ranges::min_element(orders, {}, &ArOrder::fpe)->order;
}

}  // namespace tandem::haptics
