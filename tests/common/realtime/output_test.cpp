// Tests how many lines of a flood a log keeps. Another test, tests/system/output_test.py, checks that no thread waits
// for a reader.
#include "common/realtime/output.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tandem::realtime {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> flooded(LineLimit& limit, std::string_view kind, std::size_t lines, LocalTime now) {
  std::vector<std::string> admitted;
  for (std::size_t i = 0; i < lines; ++i) {
    for (std::string& line : limit.admitted(kind, "line", now)) admitted.push_back(std::move(line));
  }
  return admitted;
}

TEST(LineLimit, PassesTheFirstLinesOfAFloodAndTheNumberOfTheRest) {
  LineLimit limit;
  const LocalTime start{std::chrono::seconds(5)};
  const auto admitted = flooded(limit, "closed", 1000, start);
  ASSERT_EQ(admitted.size(), LineLimit::kMaxLines + 1);
  EXPECT_THAT(admitted.back(), HasSubstr("more than 60 lines a minute of the kind \"closed\""));
  EXPECT_THAT(limit.admitted("joined", "ada joined", start), ElementsAre("ada joined"))
      << "other kinds are not touched";
  EXPECT_THAT(limit.admitted("joined", "ben joined", start + LineLimit::kWindow),
              ElementsAre("left out: 940 lines of the kind \"closed\"", "ben joined"));
  EXPECT_THAT(limit.left_out(), IsEmpty()) << "it has been said";
}

TEST(LineLimit, ReportsTheSuppressedLinesAtTheEnd) {
  LineLimit limit;
  flooded(limit, "closed", 61, LocalTime{});
  EXPECT_THAT(limit.left_out(), ElementsAre("left out: 1 line of the kind \"closed\""));
}

TEST(LineLimit, PassesLinesAtTheAllowedRate) {
  LineLimit limit;
  LocalTime now{};
  for (int i = 0; i < 600; ++i, now += std::chrono::seconds(1)) {
    ASSERT_THAT(limit.admitted("closed", "line", now), ElementsAre("line")) << i;
  }
}

}  // namespace
}  // namespace tandem::realtime
