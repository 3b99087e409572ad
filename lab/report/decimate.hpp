// Reduces time series for drawing. A minute at 1 kHz has 60,000 samples for about 800 pixels; the figure must be small
// but keep every extreme.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "lab/report/ticks.hpp"

namespace tandem::lab {

/// A line without gaps.
using Polyline = std::vector<Eigen::Vector2d>;

/// Reduces a series to the samples that `columns` pixel columns over `x_range` can show.
///
/// Model   keeps the first, lowest, highest and last sample of each column, in order, so the drawing is unchanged
/// Source  Jugel, Jerzak, Hackenbroich, Markl, "M4: A Visualization-Oriented Time Series Data Aggregation",
///         PVLDB 7(10), 2014
/// In      x  not decreasing, finite; y  same size. A sample that is not finite makes a gap, unless the whole gap is
///         within one column
/// Out     lines with at most 4·columns points in total; samples outside x_range are left out
/// Fails   std::invalid_argument: sizes differ, x decreases or is not finite, no column
/// Cost    O(n)
std::vector<Polyline> decimate(std::span<const double> x, std::span<const double> y, Range x_range,
                               std::size_t columns);

}  // namespace tandem::lab
