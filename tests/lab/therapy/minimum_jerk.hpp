// Movements of minimum jerk, their spectrum in closed form, and their spectral arc length.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace tandem::lab {

/// Position of a minimum-jerk movement of length 1 at τ = 0..1. For τ outside this range the position is that of the
/// nearest end.
/// Source  Flash, Hogan, "The coordination of arm movements", J. Neurosci. 5(7), 1985: 10 τ³ − 15 τ⁴ + 6 τ⁵
inline double minimum_jerk(double tau) {
  if (tau <= 0) return 0;
  if (tau >= 1) return 1;
  return tau * tau * tau * (10 + tau * (6 * tau - 15));
}
inline double minimum_jerk_speed(double tau) {
  return tau <= 0 || tau >= 1 ? 0 : 30 * tau * tau * (1 - tau) * (1 - tau);
}

/// Returns the magnitude of the spectrum of minimum_jerk_speed(), divided by its value at 0 Hz.
/// * k = π f T, with the frequency f and the duration T of the movement
/// * j₂: spherical Bessel function
///
/// The speed is proportional to (1 − x²)² over −1 ≤ x ≤ 1. The Fourier integral of this function is 16 j₂(k)/k².
inline double minimum_jerk_spectrum(double k) {
  if (k < 1e-2) return 1 - k * k / 14;
  const double j2 = (3 / (k * k * k) - 1 / k) * std::sin(k) - 3 * std::cos(k) / (k * k);
  return std::abs(15 * j2 / (k * k));
}

/// Returns the spectral arc length of a spectrum. The spectrum must be 1 at k = 0, and must stay below 0.05 once it has
/// fallen to 0.05.
template <class Spectrum>
double arc_length_of(const Spectrum& spectrum) {
  constexpr double kThreshold = 0.05;
  double low = 0, high = 0;
  while (spectrum(high) >= kThreshold) high += 0.01;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (spectrum(middle) >= kThreshold ? low : high) = middle;
  }
  constexpr int kParts = 100'000;
  double length = 0, before = spectrum(0);
  for (int i = 1; i <= kParts; ++i) {
    const double now = spectrum(low * i / kParts);
    length += std::hypot(1.0 / kParts, now - before);
    before = now;
  }
  return -length;
}

/// Speed of a minimum-jerk movement, sampled from rest to rest.
inline std::vector<double> minimum_jerk_profile(double length_m, double duration_s, double rate_hz) {
  std::vector<double> speed;
  const auto count = static_cast<std::size_t>(std::floor(duration_s * rate_hz)) + 1;
  for (std::size_t i = 0; i < count; ++i) {
    speed.push_back(length_m / duration_s * minimum_jerk_speed(static_cast<double>(i) / (duration_s * rate_hz)));
  }
  return speed;
}

}  // namespace tandem::lab
