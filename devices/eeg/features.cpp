#include "devices/eeg/features.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::eeg {
namespace {

/// Returns the mean of |x(n + lag) − x(n)| over n.
double mean_difference(std::span<const double> x, std::size_t lag) {
  if (x.size() <= lag) return 0;
  double sum = 0;
  for (std::size_t n = lag; n < x.size(); ++n) sum += std::abs(x[n] - x[n - lag]);
  return sum / static_cast<double>(x.size() - lag);
}

/// Returns L(k) of Higuchi's method: the mean length of the k curves that each connect every k-th sample.
double curve_length(std::span<const double> x, std::size_t k) {
  double length = 0;
  for (std::size_t m = 0; m < k; ++m) {
    const std::size_t increments = (x.size() - 1 - m) / k;
    double sum = 0;
    for (std::size_t i = 1; i <= increments; ++i) sum += std::abs(x[m + i * k] - x[m + (i - 1) * k]);
    length += sum / static_cast<double>(increments);
  }
  const auto interval = static_cast<double>(k);
  return length * static_cast<double>(x.size() - 1) / (interval * interval * interval);
}

}  // namespace

std::array<double, 6> picard_features(std::span<const double> x) {
  const auto count = static_cast<double>(x.size());
  double mean = 0, squares = 0;
  for (const double value : x) mean += value / count;
  for (const double value : x) squares += (value - mean) * (value - mean);
  const double deviation = x.size() > 1 ? std::sqrt(squares / (count - 1)) : 0;
  const double first = mean_difference(x, 1), second = mean_difference(x, 2);
  // The deviation of a constant signal may differ from 0 by rounding errors, and dividing by it would give large
  // features. A constant signal is therefore detected by its differences, which are exactly 0.
  const bool is_constant = first == 0 && second == 0;
  const double scale = is_constant || deviation == 0 ? 0 : 1 / deviation;
  return {mean, is_constant ? 0 : deviation, first, first * scale, second, second * scale};
}

double higuchi_dimension(std::span<const double> x, std::size_t k_max) {
  double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  for (std::size_t k = 1; k <= k_max; ++k) {
    const double length = curve_length(x, k);
    if (length <= 0) return 1;
    const double a = -std::log(static_cast<double>(k)), b = std::log(length);
    sum_x += a;
    sum_y += b;
    sum_xx += a * a;
    sum_xy += a * b;
  }
  const auto count = static_cast<double>(k_max);
  return (count * sum_xy - sum_x * sum_y) / (count * sum_xx - sum_x * sum_x);
}

std::array<double, kFeatureCount> features_of(std::span<const double> x) {
  std::array<double, kFeatureCount> features{};
  std::ranges::copy(picard_features(x), features.begin());
  features.back() = higuchi_dimension(x);
  return features;
}

}  // namespace tandem::eeg
