// Force above the frequency band of hand motion, which separates vibration from touch.
#pragma once

#include <span>
#include <vector>

namespace tandem::lab {

/// Butterworth high-pass of order 8. A tremor at 9 Hz is attenuated to 7e-5 at a corner of 30 Hz.
///
/// Model   four second-order sections by the bilinear transform, corner prewarped. The initial state is the steady
///         state of the first sample
/// In      corner_hz below rate_hz / 2
std::vector<double> high_passed(std::span<const double> samples, double rate_hz, double corner_hz);

double rms(std::span<const double> samples);

}  // namespace tandem::lab
