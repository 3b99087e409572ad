// Quantiles of step times and of counts for each step, as the benchmarks print them.
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
/// In      q  quantile, 0..1
std::uint32_t quantile_of(std::vector<std::uint32_t> counts, double q);

/// Returns {"p50", "p99", "p999", "max"}.
boost::json::object to_json(const TimeQuantiles& times);

}  // namespace tandem::lab
