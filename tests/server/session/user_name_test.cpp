// Tests which user names are permitted, and that two users with the same name get different names.
#include "server/session/user_name.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using testing::HasSubstr;

TEST(UserName, RefusesNamesThatCouldSpoilALogOrAWindow) {
  const std::string allowed[] = {"ada", "Zoë", "李雷", std::string(64, 'x')};
  const std::string refused[] = {"",         std::string(65, 'x'),  "a\nb", "a\x1b[2J", "a\xc2\x85", "a\u202e",
                                 "a\u2028z", std::string("a\0b", 3)};
  for (const std::string& name : allowed) {
    test::HubBench bench;
    EXPECT_EQ(bench.join(name).joined.user(), 1U) << name;
  }
  for (const std::string& name : refused) {
    test::HubBench bench;
    EXPECT_EQ(bench.join(name).joined.user(), 0U) << testing::PrintToString(name);
    for (const std::string& line : bench.log) EXPECT_THAT(line, testing::Not(HasSubstr(name.empty() ? "\n" : name)));
  }
}

TEST(UserName, RefusesNamesThatCannotBeSeenOrLookLikeAnother) {
  for (const std::string name :
       {" ", "a ", " a", "a  b", "\u200b", "ad\u200da", "\u3000", "a\u00ad", "\ufeffa", "a\U000E0041", "\u3164",
        "\u206a", "ada\u206f", "a\U0001BCA0", "a\U0001D173", "a\u00a0b"}) {
    test::HubBench bench;
    EXPECT_EQ(bench.join(name).joined.user(), 0U) << testing::PrintToString(name);
  }
  test::HubBench bench;
  EXPECT_EQ(bench.join("ada of b").joined.user(), 1U);
}

TEST(UserName, EqualNamesAreMadeDistinct) {
  test::HubBench bench;
  test::BenchClient ada = bench.join("ada");
  bench.join("ada");
  const auto received = bench.drain(ada);
  ASSERT_EQ(test::described(received), "user_joined");
  EXPECT_EQ(received[0].user_joined().name(), "ada (2)");
}

TEST(UserName, EqualLongNamesAreMadeDistinctWithinTheLimit) {
  std::string longest;
  for (int i = 0; i < 32; ++i) longest += "\u00e9";
  test::HubBench bench;
  test::BenchClient ada = bench.join(longest);
  bench.join(longest);
  const auto received = bench.drain(ada);
  ASSERT_EQ(test::described(received), "user_joined");
  EXPECT_EQ(received[0].user_joined().name(), longest.substr(0, 60) + " (2)");
}

}  // namespace
}  // namespace tandem::server
