// Reduces time series for drawing. One minute at 1 kHz has 60,000 samples, but a figure has about 800 pixel columns.
// The reduced figure is small and still shows every extreme value.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "lab/report/ticks.hpp"

namespace tandem::lab {

/// A connected line without gaps.
using Polyline = std::vector<Eigen::Vector2d>;

/// Reduces a series to the samples that are visible in a figure with `columns` pixel columns over `x_range`.
///
/// Model   keeps the first, lowest, highest and last sample of each column, in order, so that the drawing does not
///         change
/// Source  Jugel, Jerzak, Hackenbroich, Markl, "M4: A Visualization-Oriented Time Series Data Aggregation",
///         PVLDB 7(10), 2014
/// In      x  x values of the samples: finite, never decreasing
///         y  y values, one for each x. A value that is not finite causes a gap in the line, unless the gap is narrower
///         than a pixel column
/// Out     lines with at most 4·columns points in total; samples outside x_range are omitted
/// Fails   std::invalid_argument: the sizes differ, x decreases or is not finite, or `columns` is 0
/// Cost    O(n)
std::vector<Polyline> decimate(std::span<const double> x, std::span<const double> y, Range x_range,
                               std::size_t columns);

}  // namespace tandem::lab
