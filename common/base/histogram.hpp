// Histogram of lateness and durations. They are reported as quantiles, never as a mean: in a haptic loop the tail
// matters.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/time.hpp"

namespace tandem {

/// Counts durations from 0 to 100 s in log-spaced buckets (relative width ≤ 1/32), with the exact maximum.
///
/// Cost    record(): no allocation, no lock, a few ns
/// Thread  one writer; read after the writer has stopped, or copy through a mailbox
class Histogram {
 public:
  /// Adds one duration; a negative one counts as 0.
  void record(Duration value);
  void merge(const Histogram& other);

  std::uint64_t count() const { return count_; }
  /// Sum of all durations.
  Duration sum() const { return sum_; }
  Duration max() const { return max_; }
  /// Upper edge of the bucket that holds the q-quantile (0 ≤ q ≤ 1), never above max(); 0 when empty.
  Duration quantile(double q) const;
  /// Number of durations above `value`, at the resolution of a bucket.
  std::uint64_t count_above(Duration value) const;
  /// Share of all durations above `value`; 0 when empty.
  double share_above(Duration value) const;

 private:
  static constexpr std::size_t kSubBuckets = 32;             // per power of two
  static constexpr std::size_t kBuckets = kSubBuckets * 34;  // up to 2^38 ns ≈ 275 s

  static std::size_t bucket_of(std::uint64_t nanoseconds);
  static std::uint64_t upper_edge(std::size_t bucket);

  std::array<std::uint64_t, kBuckets> buckets_{};  // 32 bits would be full after 50 days at 1 kHz
  std::uint64_t count_ = 0;
  Duration sum_{0};
  Duration max_{0};
};

}  // namespace tandem
