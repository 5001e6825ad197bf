// A person's TOML file changed line by line: what is not meant to change stays to the byte.
#include <gtest/gtest.h>

#include <vector>

#include "machine/file_text.h"
#include "machine/toml_reader.h"

namespace knuckle {
namespace {

TEST(TomlLines, TellOfEachLineItsTableAndItsKey) {
  std::vector<std::string> told;
  const std::string text = "name = \"a\"\n# b = 1\n\n  [c.d]  # [e]\n\tf =[1]\n[[g]]\n";
  const auto tell = [&told](const std::string& table, const std::string& key, std::string&) {
    told.push_back(table + ' ' + key);
  };
  EXPECT_EQ(edited_toml(text, tell), text);
  EXPECT_EQ(told, (std::vector<std::string>{" name", " ", " ", "[c.d] [c.d]", "[c.d] f", "[[g]] [[g]]"}));
}

TEST(TomlLines, ChangeAValueAndKeepTheCommentInItsPlace) {
  EXPECT_EQ(with_toml_value("a = 1  # why", "25"), "a = 25 # why");
  EXPECT_EQ(with_toml_value("a = 1      # why", "25"), "a = 25     # why");
  EXPECT_EQ(with_toml_value("a =1", "25"), "a = 25");
}

TEST(TomlLines, KeepTheLineEndsOfTheFile) {
  for (const std::string line : {"a = 1\r", "a = 1  # why\r"}) EXPECT_TRUE(with_toml_value(line, "25").ends_with('\r'));
  EXPECT_EQ(with_toml_value("a = 1\r", "25"), "a = 25\r");
}

TEST(TomlLines, TakeOutARecordAndKeepTheTablesOfOthersBehindIt) {
  const std::string kept = "name = \"a\"  # mine\n\n[recorder]\nb = 1\n", own = "# Written by x.\n";
  for (const std::string record : {"[record]\nb = 2\n\n[record.c]\nd = 3\n", "[[record.c]]\nd = 3\n",
                                   "  [ record ]  # made\nb = 2\n", "[record . c]\r\nd = 3\r\n"}) {
    EXPECT_EQ(without_toml_record(kept + "\n" + own + record, "record", "# Written by x."), kept) << record;
    EXPECT_EQ(without_toml_record("name = \"a\"  # mine\n\n" + record + own + "[recorder]\nb = 1\n", "record",
                                  "# Written by x."),
              kept)
        << record;
  }
  EXPECT_EQ(without_toml_record(kept, "record", "# Written by x."), kept);
  EXPECT_EQ(without_toml_record("", "record", "# Written by x."), "\n");
  EXPECT_EQ(without_toml_record("# Written by x.\r\n# Written by x. Checked by me.\n", "record", "# Written by x."),
            "# Written by x. Checked by me.\n");
}

TEST(TomlLines, AreAddedAndTakenOutAndTheLastOneStaysWithoutAnEnd) {
  const auto edit = [](const std::string&, const std::string& key, std::string& line) {
    if (key == "b") line.clear();
    if (key == "c") line += "\nd = 4";
  };
  EXPECT_EQ(edited_toml("a = 1\n\nb = 2\nc = 3\n", edit), "a = 1\n\nc = 3\nd = 4\n");
  EXPECT_EQ(edited_toml("b = 2\r\n\r\nc = 3", edit), "\r\nc = 3\nd = 4");
  EXPECT_EQ(edited_toml("a = 1\nb = 2", edit), "a = 1");
  EXPECT_EQ(edited_toml("", edit), "");
}

TEST(TomlLines, QuoteWhatIsReadAgainAsItWas) {
  for (const std::string text : {"plain", "a \"b\" \\c.csv", "\\", "gr\xC3\xBC\xC3\x9F"}) {
    EXPECT_EQ(TomlTable::parse("a = " + toml_quoted(text), "test").text("a"), text);
  }
  EXPECT_EQ(toml_quoted("a\nb\x7f"
                        "c"),
            "\"a b c\"");
}

}  // namespace
}  // namespace knuckle
