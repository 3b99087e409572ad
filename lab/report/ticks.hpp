// Where an axis is marked: round numbers, few enough to read.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tandem::lab {

/// An interval of an axis, low < high, both finite.
struct Range {
  double low = 0;
  double high = 1;
};

/// A place on an axis with its text: a tick, or a limit.
struct AxisMark {
  double value = 0;
  std::string label;
};

/// `range` made fit for a linear axis: finite, ordered, and wide enough that neighbouring doubles do not matter.
Range sane_linear(Range range);
/// Likewise for a logarithmic axis: positive, at least a factor of 2 wide.
Range sane_log(Range range);

/// At most `max_count` (≥ 3) multiples of 1, 2 or 5 times a power of ten inside `range`, labelled alike.
std::vector<AxisMark> ticks_inside(Range range, std::size_t max_count);
/// Likewise, but the first and last lie on or just outside the ends of `range`.
std::vector<AxisMark> ticks_around(Range range, std::size_t max_count);

/// Powers of ten inside `range`, thinned to at most `max_count`; 1, 2, 5 of each decade where there is room.
std::vector<AxisMark> log_ticks(Range range, std::size_t max_count);

}  // namespace tandem::lab
