// High-pass filter that removes the frequency band of hand motion, so that vibration remains.
#pragma once

#include <span>
#include <vector>

namespace tandem::lab {

/// Applies a Butterworth high-pass of order 8. At a corner frequency of 30 Hz it attenuates a tremor at 9 Hz to 7e-5.
///
/// Model   four second-order sections by the bilinear transform with prewarped corner frequency. The initial state is
///         the steady state for a constant input equal to the first sample
/// In      corner_hz below rate_hz / 2
std::vector<double> high_passed(std::span<const double> samples, double rate_hz, double corner_hz);

double rms(std::span<const double> samples);

}  // namespace tandem::lab
