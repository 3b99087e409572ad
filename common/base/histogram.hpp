// Histogram of lateness and durations. They are reported as quantiles instead of a mean, because rare long delays are
// the ones that matter in a haptic loop.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/base/time.hpp"

namespace tandem {

/// Counts durations in buckets whose width is at most 1/32 of the duration. The last bucket, which ends at 275 s, also
/// contains all longer durations. The exact maximum is stored separately.
///
/// Cost    record(): no allocation, no lock, a few ns
/// Thread  one writer. Other threads may read only after the writer has stopped, or from a copy sent by a mailbox
class Histogram {
 public:
  /// Adds one duration; a negative one counts as 0.
  void record(Duration value);
  void merge(const Histogram& other);

  std::uint64_t count() const { return count_; }
  /// Returns the sum of all durations.
  Duration sum() const { return sum_; }
  Duration max() const { return max_; }
  /// Returns the q-quantile (0 ≤ q ≤ 1), as the upper edge of its bucket or max() if that is less; 0 when empty.
  Duration quantile(double q) const;
  /// Returns the number of durations above `value`, with the accuracy of a bucket's width.
  std::uint64_t count_above(Duration value) const;
  /// Returns the fraction of all durations that are above `value`; 0 when empty.
  double share_above(Duration value) const;

 private:
  static constexpr std::size_t kSubBuckets = 32;             // number of buckets per power of two
  static constexpr std::size_t kBuckets = kSubBuckets * 34;  // the last bucket ends at 2^38 ns ≈ 275 s

  static std::size_t bucket_of(std::uint64_t nanoseconds);
  static std::uint64_t upper_edge(std::size_t bucket);

  std::array<std::uint64_t, kBuckets> buckets_{};  // 32-bit counters would overflow after 50 days at 1 kHz
  std::uint64_t count_ = 0;
  Duration sum_{0};
  Duration max_{0};
};

}  // namespace tandem
