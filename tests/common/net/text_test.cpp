#include "common/net/text.hpp"

#include <gtest/gtest.h>

namespace tandem::net {
namespace {

TEST(Printable, KeepsReadableTextAndRemovesTerminalCommands) {
  EXPECT_EQ(printable("Grüße, 手 👋"), "Grüße, 手 👋");
  EXPECT_EQ(printable("a\x1B[31mb\nc\x7F"), "a?[31mb?c?");
  EXPECT_EQ(printable("a\xC2\x9B"
                      "31mb"),
            "a?31mb")
      << "the same terminal command as a single code point";
  EXPECT_EQ(printable("a\xE2\x80\xAE"
                      "b"),
            "a?b")
      << "text from right to left";
  EXPECT_EQ(printable("a\xFF\xC3"), "a??") << "no UTF-8";
}

TEST(Printable, CutsBetweenCharacters) {
  std::string text;
  for (int i = 0; i < 300; ++i) text += "手";
  EXPECT_EQ(printable(text), text.substr(0, 399));
}

}  // namespace
}  // namespace tandem::net
