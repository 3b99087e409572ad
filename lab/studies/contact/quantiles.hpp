// Quantiles of durations and of counts per step, in the form that the benchmarks print.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Exact quantiles, taken from the sorted samples. All are zero if there are no samples.
struct TimeQuantiles {
  double p50_us = 0;
  double p99_us = 0;
  double p999_us = 0;
  double max_us = 0;
};
TimeQuantiles quantiles_of(std::vector<Duration> times);
/// Returns a quantile of the counts, or 0 if there are none.
/// In      q  quantile, 0..1
std::uint32_t quantile_of(std::vector<std::uint32_t> counts, double q);

/// Returns {"p50", "p99", "p999", "max"}.
boost::json::object to_json(const TimeQuantiles& times);

}  // namespace tandem::lab
