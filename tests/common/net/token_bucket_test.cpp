#include "common/net/token_bucket.hpp"

#include <gtest/gtest.h>

namespace tandem::net {
namespace {

LocalTime at_ms(int ms) {
  return LocalTime(std::chrono::milliseconds(1000 + ms));
}

TEST(TokenBucket, GrantsItsBurstAtOnceAndThenItsRate) {
  TokenBucket bucket({100, 20});
  int taken = 0;
  while (bucket.consume(1, at_ms(0))) ++taken;
  EXPECT_EQ(taken, 20);
  for (int ms = 1; ms <= 1000; ++ms) {
    if (!bucket.has_some(at_ms(ms))) continue;
    bucket.consume(1, at_ms(ms));
    ++taken;
  }
  EXPECT_NEAR(taken, 120, 2) << "100 tokens within a second, minus the debt";
}

TEST(TokenBucket, GrantsItsRateForAnyQueryRate) {
  for (const int period_ms : {1, 7, 50, 400}) {
    TokenBucket bucket({4, 8});
    int granted = 0;
    for (int ms = 0; ms < 60'000; ms += period_ms) granted += bucket.try_consume(1, at_ms(ms));
    EXPECT_NEAR(granted, std::min(60'000 / period_ms, 8 + 4 * 60), 2) << period_ms;
  }
}

TEST(TokenBucket, NeverHoldsMoreThanItsSize) {
  TokenBucket bucket({100, 20});
  bucket.consume(20, at_ms(0));
  EXPECT_FALSE(bucket.has_some(at_ms(0)));
  EXPECT_FALSE(bucket.is_full(at_ms(100)));
  EXPECT_TRUE(bucket.is_full(at_ms(3'600'000)));
  EXPECT_TRUE(bucket.consume(20, at_ms(3'600'000)));
  EXPECT_FALSE(bucket.consume(0.5, at_ms(3'600'000)));
}

TEST(TokenBucket, ACostAboveTheBalanceBecomesDebt) {
  TokenBucket bucket({1000, 2});
  EXPECT_FALSE(bucket.consume(10, at_ms(0)));
  EXPECT_FALSE(bucket.has_some(at_ms(8)));
  EXPECT_TRUE(bucket.has_some(at_ms(9)));
}

TEST(TokenBucket, NoMoreIsOwedThanItHolds) {
  TokenBucket bucket({100, 20});
  for (int i = 0; i < 1000; ++i) bucket.consume(1, at_ms(0));
  EXPECT_FALSE(bucket.has_some(at_ms(200)));
  EXPECT_TRUE(bucket.has_some(at_ms(201)));
}

}  // namespace
}  // namespace tandem::net
