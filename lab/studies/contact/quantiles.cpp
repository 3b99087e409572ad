#include "lab/studies/contact/quantiles.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::lab {

TimeQuantiles quantiles_of(std::vector<Duration> times) {
  if (times.empty()) return {};
  std::sort(times.begin(), times.end());
  const auto at = [&times](double q) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(times.size())));
    return to_seconds(times[std::max<std::size_t>(rank, 1) - 1]) * 1e6;
  };
  return {at(0.5), at(0.99), at(0.999), at(1)};
}

boost::json::object to_json(const TimeQuantiles& times) {
  return {{"p50", times.p50_us}, {"p99", times.p99_us}, {"p999", times.p999_us}, {"max", times.max_us}};
}

}  // namespace tandem::lab
