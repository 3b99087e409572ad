// Tests the parsing of quantities with units. Detects numbers without a unit that are accepted.
#include "common/base/units.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace tandem {
namespace {

using ::testing::HasSubstr;

std::string error_of_duration(std::string_view text) {
  try {
    parse_duration(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Units, DurationsAreReadToTheNanosecondInEveryUnit) {
  EXPECT_EQ(parse_duration("25ms"), std::chrono::milliseconds(25));
  EXPECT_EQ(parse_duration("1.5 s"), std::chrono::milliseconds(1500));
  EXPECT_EQ(parse_duration("200us"), std::chrono::microseconds(200));
  EXPECT_EQ(parse_duration("7ns"), Duration(7));
  EXPECT_EQ(parse_duration("0s"), Duration{0});
  EXPECT_EQ(parse_duration("90min"), std::chrono::minutes(90));
  EXPECT_EQ(parse_duration("1.5h"), std::chrono::minutes(90));
  EXPECT_EQ(parse_duration("30 d"), std::chrono::hours(720));
  EXPECT_EQ(parse_duration("0.3ms"), std::chrono::microseconds(300)) << "0.3 ms is not exact in binary";
}

TEST(Units, BareNumberIsRefusedWithTheFix) {
  EXPECT_THAT(error_of_duration("25"), HasSubstr("write 25ms"));
}

TEST(Units, NonsenseIsRefusedNotGuessed) {
  for (const char* text : {"", "ms", "-1ms", "nan s", "inf s", "25 m", "25ms!", "1e300s", "0x10ms", "25,5ms"}) {
    EXPECT_NE(error_of_duration(text), "accepted") << text;
  }
}

TEST(Units, MissingUnitIsAnsweredWithTheUsualOne) {
  try {
    parse_duration("3", "s");
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "'3' has no unit; write 3s (ns, us, ms, s, min, h or d)");
  }
}

TEST(Units, FractionsAboveTheLargestAreAnsweredWithIt) {
  EXPECT_DOUBLE_EQ(parse_fraction("95%", 0.95), 0.95);
  try {
    parse_fraction("96%", 0.95);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "'96%' is out of range; write 0% to 95%, or 0 to 0.95");
  }
}

TEST(Units, FractionsArePercentOrPlain) {
  EXPECT_DOUBLE_EQ(parse_fraction("1%"), 0.01);
  EXPECT_DOUBLE_EQ(parse_fraction("0.25"), 0.25);
  EXPECT_DOUBLE_EQ(parse_fraction("100 %"), 1.0);
  for (const char* text : {"", "%", "120%", "1.01", "-1%", "nan", "5permille"}) {
    EXPECT_THROW(parse_fraction(text), std::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace tandem
