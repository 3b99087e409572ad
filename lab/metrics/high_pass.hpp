// What is left of a force above the band in which hands move: how vibration is told from touch.
#pragma once

#include <span>
#include <vector>

namespace tandem::lab {

/// Butterworth high pass of order 8: a tremor at 9 Hz is down to 7e-5 at a corner of 30 Hz.
///
/// Model   four second-order sections by the bilinear transform, corner prewarped; started as if the first sample had
///         been there for ever
/// In      corner_hz below rate_hz / 2
std::vector<double> high_passed(std::span<const double> samples, double rate_hz, double corner_hz);

double rms(std::span<const double> samples);

}  // namespace tandem::lab
