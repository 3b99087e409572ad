// Smoothness of a movement, measured as the length of the curve of its speed spectrum.
#pragma once

#include <cstddef>
#include <span>

namespace tandem::lab {

/// Longest speed profile of spectral_arc_length(), in samples.
inline constexpr std::size_t kMaxSpeedSamples = std::size_t{1} << 14U;

/// Returns the spectral arc length (SPARC) of a movement. It is negative; a smoother movement has a value nearer to 0.
/// It depends neither on the amplitude nor on the duration of a movement. A minimum-jerk movement has −1.41.
///
/// Model   −∫₀^fc √((1/fc)² + (dV/df)²) df
///         * V(f): magnitude of the spectrum of the speed, divided by its value at 0 Hz
///         * fc: highest frequency up to 10 Hz at which V ≥ 0.05
/// Source  Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet, "On the analysis of movement smoothness", J.
///         NeuroEng. Rehabil. 12:112, 2015. The limits of 10 Hz and 0.05, and the zero padding to 16 times the length,
///         are those of the authors' program smoothness.py. That program divides the spectrum by its largest magnitude.
///         This gives the same result, because the spectrum of a speed, which is never negative, is largest at 0 Hz
/// In      speed    samples at a constant rate, from rest to rest: 3 to kMaxSpeedSamples finite values ≥ 0
///         rate_hz  sampling rate, above 20
/// Fails   returns NaN if the input is out of its range or has no motion
/// Cost    O(n log n)
double spectral_arc_length(std::span<const double> speed, double rate_hz);

}  // namespace tandem::lab
