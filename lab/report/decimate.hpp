// A minute at 1 kHz is 60,000 samples for about 800 pixels: the picture must stay small without losing the one
// sample that matters.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "lab/report/ticks.hpp"

namespace tandem::lab {

/// A line without gaps.
using Polyline = std::vector<Eigen::Vector2d>;

/// Reduces a series to what `columns` pixel columns over `x_range` can show.
///
/// Model   of each column the first, lowest, highest and last sample stay, in their order: the drawing is the same
/// Source  Jugel, Jerzak, Hackenbroich, Markl, "M4: A Visualization-Oriented Time Series Data Aggregation",
///         PVLDB 7(10), 2014
/// In      x  not decreasing, finite; y  as many; a sample that is not finite makes a gap, unless all of the gap lies
///         within one column
/// Out     lines of together at most 4·columns points; samples outside x_range are left out
/// Fails   std::invalid_argument: sizes differ, x decreases or is not finite, no column
/// Cost    O(n)
std::vector<Polyline> decimate(std::span<const double> x, std::span<const double> y, Range x_range,
                               std::size_t columns);

}  // namespace tandem::lab
