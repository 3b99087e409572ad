#include "lab/therapy/spectral_arc_length.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace tandem::lab {
namespace {

constexpr double kCutOff_hz = 10;
constexpr double kAmplitudeThreshold = 0.05;
constexpr unsigned kPaddingLevel = 4;
constexpr double kNoLength = std::numeric_limits<double>::quiet_NaN();

using Complex = std::complex<double>;

/// Permutes the elements by bit reversal of their indices, as the radix-2 transform requires.
void reverse_order(std::vector<Complex>& values) {
  for (std::size_t i = 1, j = 0; i < values.size(); ++i) {
    std::size_t bit = values.size() >> 1U;
    for (; (j & bit) != 0; bit >>= 1U) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(values[i], values[j]);
  }
}

/// Computes the discrete Fourier transform in place, by the radix-2 algorithm of Cooley and Tukey.
/// In      values  their number must be a power of two
void transform(std::vector<Complex>& values) {
  reverse_order(values);
  std::vector<Complex> roots(values.size() / 2);
  for (std::size_t k = 0; k < roots.size(); ++k) {
    roots[k] = std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(values.size()));
  }
  for (std::size_t size = 2; size <= values.size(); size *= 2) {
    const std::size_t half = size / 2, stride = values.size() / size;
    for (std::size_t begin = 0; begin < values.size(); begin += size) {
      for (std::size_t k = 0; k < half; ++k) {
        const Complex odd = roots[k * stride] * values[begin + k + half];
        values[begin + k + half] = values[begin + k] - odd;
        values[begin + k] += odd;
      }
    }
  }
}

bool is_usable(std::span<const double> speed, double rate_hz) {
  return speed.size() >= 3 && speed.size() <= kMaxSpeedSamples && rate_hz > 2 * kCutOff_hz && std::isfinite(rate_hz) &&
         std::ranges::all_of(speed, [](double value) { return std::isfinite(value) && value >= 0; }) &&
         std::ranges::any_of(speed, [](double value) { return value > 0; });
}

}  // namespace

double spectral_arc_length(std::span<const double> speed, double rate_hz) {
  if (!is_usable(speed, rate_hz)) return kNoLength;
  // The speeds are divided by their maximum, so that their sum cannot overflow.
  const double largest = *std::ranges::max_element(speed);
  std::vector<Complex> spectrum(std::bit_ceil(speed.size()) << kPaddingLevel);
  std::ranges::transform(speed, spectrum.begin(), [largest](double value) { return Complex(value / largest); });
  transform(spectrum);

  const double size = static_cast<double>(spectrum.size());
  const auto last_allowed = static_cast<std::size_t>(kCutOff_hz * size / rate_hz);
  std::vector<double> magnitude(last_allowed + 1);
  for (std::size_t k = 0; k <= last_allowed; ++k) magnitude[k] = std::abs(spectrum[k]) / std::abs(spectrum[0]);
  std::size_t last = last_allowed;
  while (last > 0 && magnitude[last] < kAmplitudeThreshold) --last;
  if (last == 0) return kNoLength;
  double length = 0;
  for (std::size_t k = 1; k <= last; ++k) {
    length += std::hypot(1 / static_cast<double>(last), magnitude[k] - magnitude[k - 1]);
  }
  return -length;
}

}  // namespace tandem::lab
