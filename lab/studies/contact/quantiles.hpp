// Quantiles of step times and of counts a step, as printed by the benchmarks.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/json.hpp"
#include "common/base/time.hpp"

namespace tandem::lab {

/// Exact order statistics; zero without samples.
struct TimeQuantiles {
  double p50_us = 0;
  double p99_us = 0;
  double p999_us = 0;
  double max_us = 0;
};
TimeQuantiles quantiles_of(std::vector<Duration> times);
/// In      q  0..1
std::uint32_t quantile_of(std::vector<std::uint32_t> counts, double q);

/// {"p50", "p99", "p999", "max"}
boost::json::object to_json(const TimeQuantiles& times);

}  // namespace tandem::lab
