// The one line a user gets for every way a TOML file can be wrong.
#include "machine/toml_reader.h"

#include <gtest/gtest.h>

#include <functional>

#include "core/error.h"

namespace knuckle {
namespace {

std::string refusal(const std::string& text, const std::function<void(TomlTable&)>& reader) {
  try {
    TomlTable file = TomlTable::parse(text, "m.toml");
    reader(file);
    file.finish();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

void ask_for_relief(TomlTable& file) {
  (void)file.table("hydraulics").number("main_relief_bar", 50, 400, 1e5);
}
void ask_for_x(TomlTable& file) {
  (void)file.number("x", 0, 1);
}

TEST(TomlReader, ReadsEveryKindAndConvertsUnits) {
  TomlTable file = TomlTable::parse(R"(
    name = "n"
    on = true
    count = 0x10
    mount = "boom"
    whole = 3
    at = [1, 2.5]
    [hydraulics]
    main_relief_bar = 205
    [[wall]]
    x = 0.5
    [[wall]]
    x = 0.75
  )",
                                    "m.toml");
  EXPECT_EQ(file.text("name"), "n");
  EXPECT_TRUE(file.boolean("on"));
  EXPECT_EQ(file.integer("count", 1, 127), 16);
  EXPECT_EQ(file.choice("mount", {"hull", "boom"}), 1);
  EXPECT_EQ(file.number("whole", 0, 5), 3.0);
  EXPECT_EQ(file.numbers<2>("at", 0, 10, 1e-3), Eigen::Vector2d(1e-3, 2.5e-3));
  EXPECT_EQ(file.table("hydraulics").number("main_relief_bar", 50, 400, 1e5), 205e5);
  auto walls = file.tables("wall");
  ASSERT_EQ(walls.size(), 2u);
  EXPECT_EQ(walls[0].number("x", 0, 1), 0.5);
  EXPECT_EQ(walls[1].number("x", 0, 1), 0.75);
  EXPECT_TRUE(file.tables("hole").empty());
  EXPECT_TRUE(file.has("on"));
  EXPECT_FALSE(file.has("off"));
  EXPECT_NO_THROW(file.finish());
}

TEST(TomlReader, NamesFileLineKeyValueAndBound) {
  EXPECT_EQ(refusal("[hydraulics]\nmain_relief_bar = 900", ask_for_relief),
            "m.toml:2: key 'hydraulics.main_relief_bar' = 900: must be within [50, 400]");
  EXPECT_EQ(refusal("[hydraulics]\n\nmain_relief_bar = nan", ask_for_relief),
            "m.toml:3: key 'hydraulics.main_relief_bar' = nan: must be within [50, 400]");
  EXPECT_EQ(refusal("[hydraulics]\nmain_relief_bar = '205 bar'", ask_for_relief),
            "m.toml:2: key 'hydraulics.main_relief_bar' = '205 bar': must be a number within [50, 400]");
  EXPECT_EQ(refusal("x = [1, 2, 3]", [](TomlTable& file) { (void)file.numbers<2>("x", 0, 10); }),
            "m.toml:1: key 'x' = [ 1, 2, 3 ]: must be 2 numbers within [0, 10]");
  EXPECT_EQ(refusal("x = 2.5", [](TomlTable& file) { (void)file.integer("x", 0, 10); }),
            "m.toml:1: key 'x' = 2.5: must be a whole number within [0, 10]");
  EXPECT_EQ(refusal("x = 'hul'",
                    [](TomlTable& file) {
                      (void)file.choice("x", {"hull", "boom"});
                    }),
            "m.toml:1: key 'x' = 'hul': must be one of \"hull\", \"boom\"");
  EXPECT_EQ(refusal("[[wall]]\nx = 1\n[[wall]]\nx = 2",
                    [](TomlTable& file) {
                      for (TomlTable& wall : file.tables("wall")) ask_for_x(wall);
                    }),
            "m.toml:4: key 'wall[1].x' = 2: must be within [0, 1]");
}

TEST(TomlReader, BoundsAreInclusiveAndIntegersKeepTheirs) {
  EXPECT_EQ(refusal("x = 1", ask_for_x), "accepted");
  EXPECT_EQ(refusal("x = 0.0", ask_for_x), "accepted");
  EXPECT_NE(refusal("x = 1.0000001", ask_for_x), "accepted");
  EXPECT_NE(refusal("x = 9223372036854775807", [](TomlTable& file) { (void)file.integer("x", 0, 10); }), "accepted");
}

TEST(TomlReader, SuggestsTheNearestKeyForAMisspeltOne) {
  EXPECT_EQ(refusal("[hydraulics]\nmain_releif_bar = 205", ask_for_relief),
            "m.toml:2: key 'hydraulics.main_relief_bar' is missing; is 'main_releif_bar' here meant to be it?");
  EXPECT_EQ(refusal("[hydraulics]\nmain_relief_bar = 205\nmain_relief = 200", ask_for_relief),
            "m.toml:3: key 'hydraulics.main_relief' = 200: unknown key; did you mean 'main_relief_bar'?");
  EXPECT_EQ(refusal("x = 1\nquite_other = 2", ask_for_x), "m.toml:2: key 'quite_other' = 2: unknown key");
  EXPECT_EQ(refusal("[hydraulics]\n", ask_for_relief), "m.toml:1: key 'hydraulics.main_relief_bar' is missing");
}

TEST(TomlReader, WhatIsLeftToOthersMayHoldAnything) {
  const auto read = [](TomlTable& file) {
    (void)file.number("x", 0, 1);
    file.leave("record");
  };
  EXPECT_EQ(refusal("x = 1", read), "accepted");
  EXPECT_EQ(refusal("x = 1\n[record]\nany = 1\n[[record.more]]\nkeys = [2]", read), "accepted");
  EXPECT_NE(refusal("x = 1\n[records]\nany = 1", read), "accepted");
}

TEST(TomlReader, SaysWhereTheSyntaxBreaks) {
  const std::string line = refusal("x = 1\ny = = 2\n", ask_for_x);
  EXPECT_EQ(line.rfind("m.toml:2: ", 0), 0u) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  EXPECT_NE(refusal("x = 1\nx = 2", ask_for_x), "accepted") << "a key given twice";
  EXPECT_NE(refusal(std::string("x = 1 # \xff\xfe"), ask_for_x), "accepted") << "not UTF-8";
}

TEST(TomlReader, StaysOnOneLineWhateverTheFileHolds) {
  for (const std::string text : {"x = \"\"\"a\nb\"\"\"", "x = 1\n\"a\\nb\" = 2", "x = 1\ny = [\n1,\n2]"}) {
    const std::string line = refusal(text, ask_for_x);
    EXPECT_NE(line, "accepted");
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

TEST(TomlReader, UnreadableFilesAreNamed) {
  for (const std::string path : {"/nowhere/m.toml", "/tmp"}) {
    try {
      (void)TomlTable::read(path);
      FAIL() << path;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind(path + ": cannot be read: ", 0), 0u) << error.what();
    }
  }
}

}  // namespace
}  // namespace knuckle
