#include "devices/eeg/artefacts.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace tandem::eeg {
namespace {

/// Returns the samples without their mean, multiplied by a Hann window. The window is needed to estimate the power at a
/// single frequency, because it reduces the leakage from other frequencies.
std::vector<double> tapered(std::span<const double> x) {
  const auto count = static_cast<double>(x.size());
  double mean = 0;
  for (const double value : x) mean += value / count;
  std::vector<double> y(x.size());
  for (std::size_t n = 0; n < x.size(); ++n) {
    const double hann = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(n) / count);
    y[n] = (x[n] - mean) * hann;
  }
  return y;
}

double power_at(std::span<const double> x, double cycles_per_sample) {
  const std::complex<double> turn = std::polar(1.0, -2 * std::numbers::pi * cycles_per_sample);
  std::complex<double> phase = 1, sum = 0;
  for (const double value : x) {
    sum += value * phase;
    phase *= turn;
  }
  return std::norm(sum);
}

/// Returns the fraction of the signal's power that lies within 1 Hz of a frequency. The numerator is a sum over bins of
/// the discrete Fourier transform. The denominator is the sum of squares of the samples (Parseval's theorem).
double share_near(std::span<const double> tapered_uv, double frequency_hz, double rate_hz) {
  const auto count = static_cast<double>(tapered_uv.size());
  double total = 0, near = 0;
  for (const double value : tapered_uv) total += value * value;
  if (total <= 0) return 0;
  const auto first = static_cast<int>(std::ceil((frequency_hz - 1) * count / rate_hz));
  const auto last = static_cast<int>(std::floor((frequency_hz + 1) * count / rate_hz));
  for (int bin = first; bin <= last; ++bin) near += power_at(tapered_uv, bin / count);
  return 2 * near / (count * total);
}

bool has_line_noise(std::span<const double> raw_uv, double rate_hz, double limit) {
  const std::vector<double> x = tapered(raw_uv);
  return std::ranges::any_of(std::array{50.0, 60.0}, [&](double line_hz) {
    return line_hz + 1 < rate_hz / 2 && share_near(x, line_hz, rate_hz) > limit;
  });
}

double share_clipped(std::span<const double> raw_uv, const ConverterRange& range) {
  const auto clipped = std::ranges::count_if(raw_uv, [&](double x) { return x <= range.low_uv || x >= range.high_uv; });
  return static_cast<double>(clipped) / static_cast<double>(raw_uv.size());
}

double largest_step(std::span<const double> x) {
  double largest = 0;
  for (std::size_t n = 1; n < x.size(); ++n) largest = std::max(largest, std::abs(x[n] - x[n - 1]));
  return largest;
}

}  // namespace

std::uint8_t artefacts_in(std::span<const double> raw_uv, std::span<const double> filtered_uv, double rate_hz,
                          const std::optional<ConverterRange>& range, const ArtefactLimits& limits) {
  if (!std::ranges::all_of(raw_uv, [](double x) { return std::isfinite(x); })) return kLost;
  unsigned flags = 0;
  const auto [low, high] = std::ranges::minmax(raw_uv);
  if (high - low < limits.flat_uv) flags |= kFlat;
  if (range && share_clipped(raw_uv, *range) > limits.clipped_share) flags |= kClipped;
  if (std::ranges::any_of(filtered_uv, [&](double x) { return std::abs(x) > limits.amplitude_uv; }))
    flags |= kAmplitude;
  if ((flags & kFlat) == 0 && has_line_noise(raw_uv, rate_hz, limits.line_share)) flags |= kLineNoise;
  if (largest_step(raw_uv) > limits.step_uv) flags |= kStep;
  return static_cast<std::uint8_t>(flags);
}

std::string artefact_text(std::uint8_t flags) {
  std::string text;
  for (std::size_t bit = 0; bit < kArtefactNames.size(); ++bit) {
    if ((flags & (1U << bit)) != 0) text += (text.empty() ? "" : "+") + std::string(kArtefactNames[bit]);
  }
  return text;
}

}  // namespace tandem::eeg
