// Nothing that a file, a command line or a device says reaches a terminal as anything but one printable line.
#include "core/text.h"

#include <gtest/gtest.h>

#include <limits>

namespace knuckle {
namespace {

TEST(Text, EscapesControlCharactersVisibly) {
  EXPECT_EQ(printable("a\x1b[31mred\n\t\r\x7f"), "a\\x1b[31mred\\x0a\\x09\\x0d\\x7f");
  EXPECT_EQ(printable(std::string_view("\0", 1)), "\\x00");
  EXPECT_EQ(printable("\xc2\x9b[2J"), "\\xc2\\x9b[2J") << "the one character that starts an escape sequence, as UTF-8";
  EXPECT_EQ(printable("\xe2\x80\xae gpj.exe"), "\\xe2\\x80\\xae gpj.exe") << "turns the direction of writing";
  EXPECT_EQ(printable("\xe2\x80\xa8"), "\\xe2\\x80\\xa8") << "ends a line";
}

TEST(Text, OfSeveralLinesKeepsLineEndsAndTabs) {
  EXPECT_EQ(printable_lines("a\tb\nc\x1b[2J\r\n"), "a\tb\nc\\x1b[2J\\x0d\n");
  EXPECT_EQ(printable_lines("caf\xe9\n"), "caf\\xe9\n");
}

TEST(Text, LeavesWhatIsPrintableAsItIs) {
  for (const char* text : {"", "plain 'text' \\x1b",
                           "K\xc3\xbc"
                           "bel \xce\xb8 \xe2\x89\xa4 \xf0\x9f\x9a\x9c",
                           "\xc2\xa0"})
    EXPECT_EQ(printable(text), text);
}

TEST(Text, EscapesBytesThatAreNotUtf8) {
  EXPECT_EQ(printable("caf\xe9"), "caf\\xe9");
  EXPECT_EQ(printable("\xe9t\xc3\xa9"), "\\xe9t\xc3\xa9") << "goes on with the character behind the stray byte";
  EXPECT_EQ(printable("\xc3"), "\\xc3") << "cut short";
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b") << "overlong: ESC in two bytes";
  EXPECT_EQ(printable("\xe0\x80\x9b"), "\\xe0\\x80\\x9b") << "overlong: in three";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "half of a surrogate pair";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "above the last code";
}

TEST(Text, ShortensWhatIsLongAndSaysHowLongItIs) {
  const std::string key(60, 'k');
  EXPECT_EQ(shortened(key), key);
  std::string endless;
  for (int i = 0; i < 100'000; ++i) endless += "kkkkkkkkkk";
  EXPECT_EQ(shortened(endless), key + "... (1000000 characters)");
  std::string umlauts;
  for (int i = 0; i < 61; ++i) umlauts += "\xc3\xbc";
  EXPECT_EQ(shortened(umlauts), umlauts.substr(0, 120) + "... (61 characters)") << "cut between characters";
  EXPECT_EQ(shortened("\x1b\x1b\x1b", 2), "\\x1b\\x1b... (3 characters)");
}

TEST(Text, AMessageIsOnePrintableLineWithItsBeginningAndEnd) {
  std::string path;
  for (int i = 0; i < 1000; ++i) path += "pppppppppppppppppppp";
  const std::string text = one_message(path + "\x1b: must be at most 1");
  EXPECT_LT(text.size(), 4000U);
  EXPECT_TRUE(text.starts_with("pppp") && text.ends_with("\\x1b: must be at most 1")) << text;
  EXPECT_NE(text.find("(20023 characters)"), std::string::npos) << text;
  EXPECT_EQ(one_message(text), text) << "passed on, it stays as it is";
}

TEST(Text, OfATimeIsInUtcWhateverTheFormat) {
  EXPECT_EQ(utc_text(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(utc_text(1'795'885'199), "2026-11-28T16:59:59Z");
  EXPECT_EQ(utc_text(1'795'885'199, "%Y-%m-%d %H:%M:%S UTC"), "2026-11-28 16:59:59 UTC");
  EXPECT_EQ(utc_text(std::numeric_limits<std::int64_t>::max()), "") << "no year can say it";
}

}  // namespace
}  // namespace knuckle
