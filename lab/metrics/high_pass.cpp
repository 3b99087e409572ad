#include "lab/metrics/high_pass.hpp"

#include <cmath>
#include <numbers>

namespace tandem::lab {
namespace {

constexpr int kSections = 4;

/// Applies one second-order section in place: s²/(s² + 2ζ ω s + ω²) with s = (z − 1)/(z + 1) and ω = tan(π f/f_s). ζ is
/// the damping ratio, f the corner frequency and f_s the sampling rate.
void filter_section(std::vector<double>& samples, double omega, double damping_ratio) {
  const double a0 = 1 + 2 * damping_ratio * omega + omega * omega;
  const double a1 = 2 * (omega * omega - 1) / a0;
  const double a2 = (1 - 2 * damping_ratio * omega + omega * omega) / a0;
  double x1 = samples.front(), x2 = x1, y1 = 0, y2 = 0;
  for (double& sample : samples) {
    const double x = sample;
    const double y = (x - 2 * x1 + x2) / a0 - a1 * y1 - a2 * y2;
    x2 = x1;
    x1 = x;
    y2 = y1;
    y1 = y;
    sample = y;
  }
}

}  // namespace

std::vector<double> high_passed(std::span<const double> samples, double rate_hz, double corner_hz) {
  std::vector<double> result(samples.begin(), samples.end());
  if (result.empty()) return result;
  const double omega = std::tan(std::numbers::pi * corner_hz / rate_hz);
  for (int k = 0; k < kSections; ++k) {
    // The poles of a Butterworth filter lie on a half circle, in pairs at these angles to the real axis.
    filter_section(result, omega, std::cos(std::numbers::pi * (2 * k + 1) / (4 * kSections)));
  }
  return result;
}

double rms(std::span<const double> samples) {
  double sum = 0;
  for (const double sample : samples) sum += sample * sample;
  return samples.empty() ? 0 : std::sqrt(sum / static_cast<double>(samples.size()));
}

}  // namespace tandem::lab
