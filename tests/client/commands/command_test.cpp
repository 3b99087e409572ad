// Tests the parser of command lines. A command whose fields are in range is accepted; otherwise an error must name the
// wrong field and the valid values.
#include "client/commands/command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "common/net/text.hpp"

namespace tandem::client {
namespace {

using ::testing::AllOf;
using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string error_of(const std::string& line) {
  try {
    parse_command(line);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

wire::KeptPose kept(std::uint32_t number, const std::string& name) {
  wire::KeptPose pose;
  pose.set_number(number);
  pose.set_name(name);
  return pose;
}

std::string error_of_find(const std::vector<wire::KeptPose>& poses, const std::string& pose) {
  try {
    return "found #" + std::to_string(find_pose(poses, pose).number());
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(Command, FieldsAreTakenInTheirOrder) {
  const CommandLine turn = parse_command("  turn 0 -1\t0.5e0 -180 \r");
  EXPECT_EQ(turn.verb, "turn");
  EXPECT_THAT(turn.numbers, ElementsAre(DoubleEq(0), DoubleEq(-1), DoubleEq(0.5), DoubleEq(-180)));
  EXPECT_THAT(turn.texts, IsEmpty());
  EXPECT_THAT(parse_command("rename #2 bound").texts, ElementsAre("#2", "bound"));
  EXPECT_THAT(parse_command("keep").texts, IsEmpty());
  EXPECT_THAT(parse_command("minimise").numbers, IsEmpty());
  EXPECT_THAT(parse_command("minimise 2.5").numbers, ElementsAre(2.5));
}

TEST(Command, AFieldWithBlanksOrQuotesStandsInQuotes) {
  EXPECT_THAT(parse_command(R"(rename "as in the files" "a \"b\" \\ c")").texts,
              ElementsAre("as in the files", R"(a "b" \ c)"));
  EXPECT_THAT(parse_command(R"(keep "")").texts, ElementsAre(""));
  EXPECT_THAT(parse_command("keep Пептид").texts, ElementsAre("Пептид"));
  EXPECT_THAT(error_of(R"(keep "near)"), HasSubstr("quote is not closed"));
  EXPECT_THAT(error_of(R"(keep "near"er)"), HasSubstr("closing quote"));
  EXPECT_THAT(error_of("keep two words"), AllOf(HasSubstr("'words'"), HasSubstr("double quotes")));
}

TEST(Command, AnErrorNamesTheFieldItsRangeAndItsUnit) {
  EXPECT_THAT(error_of("move 1 2"), AllOf(HasSubstr("Z is missing"), HasSubstr("move X Y Z")));
  for (const char* bad : {"1,5", "0x10", "nan", "inf", "-1001", "1001", "+1", "1e400", "1m", "--1"}) {
    EXPECT_THAT(error_of("move 0 " + std::string(bad) + " 0"),
                AllOf(HasSubstr("Y: '" + std::string(bad) + "'"), HasSubstr("-1000 to 1000 [m]")))
        << bad;
  }
  EXPECT_THAT(error_of("wait -1"), AllOf(HasSubstr("SECONDS"), HasSubstr("0 to 3600 [s]")));
  EXPECT_THAT(error_of("turn 0 0 2 1"), HasSubstr("AZ"));
  EXPECT_THAT(error_of("turn 0 0 1 181"), HasSubstr("[degrees]"));
  EXPECT_THAT(error_of("visit"), HasSubstr("POSE is missing"));
  EXPECT_THAT(error_of("quit now"), HasSubstr("one field too many"));
}

TEST(Command, ALineThatIsNoCommandIsAnsweredWithThoseThatExist) {
  for (const char* line : {"", " \t ", "fly", "Keep", "#2", R"("")"}) {
    EXPECT_THAT(error_of(line), AllOf(HasSubstr("keep, "), HasSubstr("minimise"), HasSubstr("quit"))) << line;
  }
  EXPECT_THAT(error_of("keep " + std::string(kMaxCommandBytes, 'a')), HasSubstr("longer than 1024 bytes"));
  EXPECT_EQ(error_of("keep " + std::string(kMaxCommandBytes - 5, 'a')), "accepted");
  for (const std::string& line : {std::string("keep a\x1b[31m"), std::string("keep \xff"), std::string("keep a\0b", 8),
                                  std::string("keep \u202Eabc")}) {
    EXPECT_THAT(error_of(line), HasSubstr("printable"));
  }
}

TEST(Command, EachIsInTheHelpAndItsUsageIsItsOwn) {
  for (const auto& [usage, purpose] : command_usages()) {
    EXPECT_FALSE(purpose.empty());
    const std::string verb = command_word(usage);
    const std::string error = error_of(verb + " 1 1 1 1 1 1");
    EXPECT_THAT(error, HasSubstr("usage: " + usage)) << "six fields are too many for every command";
  }
}

TEST(Command, ThePoseIsTheOneOfThatNumberOrName) {
  const std::vector<wire::KeptPose> poses{kept(0, "as in the files"), kept(1, "near"), kept(4, "near"), kept(7, "4"),
                                          kept(9, "#1")};
  EXPECT_EQ(find_pose(poses, "as in the files").number(), 0U);
  EXPECT_EQ(find_pose(poses, "7").number(), 7U);
  EXPECT_EQ(find_pose(poses, "#4").number(), 4U);
  EXPECT_EQ(find_pose(poses, "#1").number(), 1U) << "not the one of that name";
  EXPECT_THAT(error_of_find(poses, "near"),
              AllOf(HasSubstr("#1 \"near\", #4 \"near\""), HasSubstr("use a number, for instance #1")));
  EXPECT_THAT(error_of_find(poses, "4"), AllOf(HasSubstr("#4 \"near\", #7 \"4\"")));
  for (const char* pose : {"far", "", "#", "#99", "-1", "4294967296", "1.0", "# 1"}) {
    EXPECT_THAT(error_of_find(poses, pose), AllOf(HasSubstr("is not kept"), HasSubstr("#0 \"as in the files\"")))
        << pose;
  }
  EXPECT_THAT(error_of_find({}, "near"), HasSubstr("there are none"));
  std::vector<wire::KeptPose> many;
  for (std::uint32_t i = 0; i < 200; ++i) many.push_back(kept(i, "pose"));
  EXPECT_THAT(error_of_find(many, "pose"), HasSubstr("and 180 more"));
}

}  // namespace
}  // namespace tandem::client
