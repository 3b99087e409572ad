#include "lab/studies/contact/quantiles.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::lab {

namespace {

template <class T>
T at(double q, const std::vector<T>& sorted) {
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

}  // namespace

TimeQuantiles quantiles_of(std::vector<Duration> times) {
  if (times.empty()) return {};
  std::ranges::sort(times);
  const auto at_us = [&times](double q) { return to_seconds(at(q, times)) * 1e6; };
  return {at_us(0.5), at_us(0.99), at_us(0.999), at_us(1)};
}

std::uint32_t quantile_of(std::vector<std::uint32_t> counts, double q) {
  if (counts.empty()) return 0;
  std::ranges::sort(counts);
  return at(q, counts);
}

boost::json::object to_json(const TimeQuantiles& times) {
  return {{"p50", times.p50_us}, {"p99", times.p99_us}, {"p999", times.p999_us}, {"max", times.max_us}};
}

}  // namespace tandem::lab
