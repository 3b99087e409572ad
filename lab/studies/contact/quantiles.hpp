// Times of steps, as the benchmarks print them.
#pragma once

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

/// {"p50", "p99", "p999", "max"}
boost::json::object to_json(const TimeQuantiles& times);

}  // namespace tandem::lab
