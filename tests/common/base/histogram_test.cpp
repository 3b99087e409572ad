#include "common/base/histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/random.hpp"

namespace tandem {
namespace {

TEST(Histogram, QuantilesAreWithinOneBucketOfTheSortedValues) {
  Random random(3);
  Histogram histogram;
  std::vector<std::int64_t> values;
  for (int i = 0; i < 100'000; ++i) {
    const auto ns = static_cast<std::int64_t>(std::exp(random.uniform(0.0, 23.0)));
    values.push_back(ns);
    histogram.record(Duration(ns));
  }
  std::sort(values.begin(), values.end());
  for (const double q : {0.01, 0.5, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size()))) - 1;
    const auto exact = static_cast<double>(values[rank]);
    const auto found = static_cast<double>(histogram.quantile(q).count());
    EXPECT_GE(found, exact) << "q " << q;
    EXPECT_LE(found, exact * (1 + 1.0 / 32) + 1) << "q " << q;
  }
}

TEST(Histogram, KeepsTheExactMaximumAndTakesNegativeAsZero) {
  Histogram histogram;
  histogram.record(Duration(-5));
  histogram.record(Duration(1'234'567));
  EXPECT_EQ(histogram.max(), Duration(1'234'567));
  EXPECT_EQ(histogram.quantile(1.0), Duration(1'234'567));
  EXPECT_EQ(histogram.quantile(0.5), Duration(0));
  EXPECT_EQ(histogram.count(), 2u);
}

TEST(Histogram, MergedEqualsRecordedTogether) {
  Random random(4);
  Histogram a;
  Histogram b;
  Histogram both;
  for (int i = 0; i < 2'000; ++i) {
    const Duration value(static_cast<std::int64_t>(random.uniform(0, 1e7)));
    (i % 2 == 0 ? a : b).record(value);
    both.record(value);
  }
  a.merge(b);
  EXPECT_EQ(a.count(), both.count());
  EXPECT_EQ(a.max(), both.max());
  EXPECT_EQ(a.sum(), both.sum());
  EXPECT_EQ(a.quantile(0.9), both.quantile(0.9));
}

TEST(Histogram, HoldsDurationsBeyondItsRangeInTheLastBucket) {
  Histogram histogram;
  histogram.record(std::chrono::hours(10));
  EXPECT_EQ(histogram.count(), 1u);
  EXPECT_GT(histogram.quantile(0.5), std::chrono::seconds(100));
}

TEST(Histogram, GivesTheFractionAboveADuration) {
  Histogram histogram;
  for (int i = 0; i < 3; ++i) histogram.record(std::chrono::microseconds(900));
  histogram.record(std::chrono::microseconds(1100));
  EXPECT_DOUBLE_EQ(histogram.share_above(std::chrono::milliseconds(1)), 0.25);
  EXPECT_DOUBLE_EQ(histogram.share_above(std::chrono::milliseconds(2)), 0);
  EXPECT_DOUBLE_EQ(histogram.share_above(Duration{0}), 1);
  EXPECT_DOUBLE_EQ(Histogram().share_above(Duration{0}), 0);
}

TEST(Histogram, GivesTheExactSumAndTheNumberAboveADuration) {
  Histogram histogram;
  for (const int us : {1, 10, 900, 1100}) histogram.record(std::chrono::microseconds(us));
  EXPECT_EQ(histogram.sum(), std::chrono::microseconds(2011));
  EXPECT_EQ(histogram.count_above(std::chrono::milliseconds(1)), 1U);
  EXPECT_EQ(histogram.count_above(std::chrono::microseconds(5)), 3U);
}

TEST(Histogram, IsZeroWhenEmpty) {
  EXPECT_EQ(Histogram().quantile(0.99), Duration(0));
}

}  // namespace
}  // namespace tandem
