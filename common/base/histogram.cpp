#include "common/base/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tandem {

std::size_t Histogram::bucket_of(std::uint64_t nanoseconds) {
  if (nanoseconds < kSubBuckets) return static_cast<std::size_t>(nanoseconds);
  // The leading bit selects the power of two; the five bits after it select the sub-bucket.
  const auto exponent = static_cast<std::size_t>(std::bit_width(nanoseconds)) - 6;
  const auto mantissa = static_cast<std::size_t>(nanoseconds >> exponent);  // the leading six bits, 32..63
  return std::min(exponent * kSubBuckets + mantissa, kBuckets - 1);
}

std::uint64_t Histogram::upper_edge(std::size_t bucket) {
  if (bucket < 2 * kSubBuckets) return bucket;
  const std::size_t exponent = bucket / kSubBuckets - 1;
  const std::uint64_t mantissa = bucket % kSubBuckets + kSubBuckets;
  return ((mantissa + 1) << exponent) - 1;
}

void Histogram::record(Duration value) {
  const Duration clipped = std::max(value, Duration{0});
  ++buckets_[bucket_of(static_cast<std::uint64_t>(clipped.count()))];
  ++count_;
  sum_ += clipped;
  max_ = std::max(max_, clipped);
}

void Histogram::merge(const Histogram& other) {
  for (std::size_t i = 0; i < kBuckets; ++i) buckets_[i] += other.buckets_[i];
  count_ += other.count_;
  sum_ += other.sum_;
  max_ = std::max(max_, other.max_);
}

Duration Histogram::quantile(double q) const {
  if (count_ == 0) return Duration{0};
  const auto rank = static_cast<std::uint64_t>(std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    seen += buckets_[i];
    if (seen >= std::max<std::uint64_t>(rank, 1)) return std::min(Duration(upper_edge(i)), max_);
  }
  return max_;
}

std::uint64_t Histogram::count_above(Duration value) const {
  std::uint64_t above = 0;
  const std::size_t edge = bucket_of(static_cast<std::uint64_t>(std::max(value, Duration{0}).count()));
  for (std::size_t i = edge + 1; i < kBuckets; ++i) above += buckets_[i];
  return above;
}

double Histogram::share_above(Duration value) const {
  return count_ == 0 ? 0 : static_cast<double>(count_above(value)) / static_cast<double>(count_);
}

}  // namespace tandem
