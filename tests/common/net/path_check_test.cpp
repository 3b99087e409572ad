#include "common/net/path_check.hpp"

#include <gtest/gtest.h>

namespace tandem::net {
namespace {

constexpr LocalTime kStart{std::chrono::seconds(1)};

TEST(PathCheck, SendsAtMostThreeTimesTheReceivedBytesToAnUnconfirmedAddress) {
  PathCheck check(42);
  EXPECT_FALSE(check.consume(1)) << "no bytes were received";
  check.note_received(100);
  EXPECT_TRUE(check.consume(200));
  EXPECT_FALSE(check.consume(101));
  EXPECT_TRUE(check.consume(100));
  check.note_received(1);
  EXPECT_TRUE(check.consume(3));
  EXPECT_FALSE(check.consume(1));
  check.note_answer(41);
  EXPECT_FALSE(check.is_valid());
  check.note_answer(42);
  EXPECT_TRUE(check.is_valid());
  EXPECT_TRUE(check.consume(1'000'000));
}

TEST(PathCheck, RepeatsTheRequestUntilItIsAnswered) {
  PathCheck check(42);
  EXPECT_TRUE(check.is_due(kStart));
  EXPECT_FALSE(check.is_due(kStart + PathCheck::kRetryPeriod / 2));
  EXPECT_TRUE(check.is_due(kStart + PathCheck::kRetryPeriod));
  check.note_answer(42);
  EXPECT_FALSE(check.is_due(kStart + 10 * PathCheck::kRetryPeriod));
}

}  // namespace
}  // namespace tandem::net
