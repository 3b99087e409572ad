// Chooses a few round numbers as ticks of an axis.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tandem::lab {

/// An interval of an axis: low < high, both finite.
struct Range {
  double low = 0;
  double high = 1;
};

/// A position on an axis with its label: a tick or a limit.
struct AxisMark {
  double value = 0;
  std::string label;
};

/// Makes `range` usable for a linear axis: finite, ordered, and much wider than the spacing of adjacent doubles.
Range sane_linear(Range range);
/// Makes `range` usable for a logarithmic axis: positive, and at least a factor of 2 wide.
Range sane_log(Range range);

/// Returns at most `max_count` (≥ 3) multiples of 1, 2 or 5 times a power of ten inside `range`. All labels have the
/// same format.
std::vector<AxisMark> ticks_inside(Range range, std::size_t max_count);
/// Same as ticks_inside(), but the first and last tick lie on or just outside the limits of `range`.
std::vector<AxisMark> ticks_around(Range range, std::size_t max_count);

/// Returns at most `max_count` ticks of a logarithmic axis inside `range`. They are the powers of ten and, if there is
/// space, also their multiples by 2 and 5. If there are too many powers of ten, only every second, third, … is
/// returned.
std::vector<AxisMark> log_ticks(Range range, std::size_t max_count);

}  // namespace tandem::lab
