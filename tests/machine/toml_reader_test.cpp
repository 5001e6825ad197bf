// The one line a user gets for every way a TOML file can be wrong.
#include "machine/toml_reader.h"

#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <algorithm>
#include <functional>
#include <random>

#include "core/text.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle {
namespace {

std::string refusal(const std::string& text, const std::function<void(TomlTable&)>& reader) {
  return test::refusal([&] {
    TomlTable file = TomlTable::parse(text, "m.toml");
    reader(file);
    file.finish();
  });
}

const std::string kOrMisplaced = ", or one that does not go with the other keys here";

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
            "m.toml:1: key 'x' = [1, 2, 3]: must be 2 numbers within [0, 10]");
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
  EXPECT_EQ(refusal("x = 1\nquite_other = 2", ask_for_x),
            "m.toml:2: key 'quite_other' = 2: unknown key" + kOrMisplaced);
  const auto may_ask_for_x = [](TomlTable& file) { return file.has("x_offset_mm"); };
  EXPECT_EQ(refusal("x_ofset_mm = 2", may_ask_for_x),
            "m.toml:1: key 'x_ofset_mm' = 2: unknown key; did you mean 'x_offset_mm'?");
  EXPECT_EQ(refusal("x_offset_mm = 2", may_ask_for_x), "m.toml:1: key 'x_offset_mm' = 2: unknown key" + kOrMisplaced);
  EXPECT_EQ(refusal("[hydraulics]\n", ask_for_relief), "m.toml:1: key 'hydraulics.main_relief_bar' is missing");
}

TEST(TomlReader, ShowsAValueAsAPersonWroteIt) {
  const auto count = [](TomlTable& file) { (void)file.integer("x", 0, 10); };
  EXPECT_EQ(refusal("x = 7.0", count), "m.toml:1: key 'x' = 7.0: must be a whole number within [0, 10]");
  EXPECT_EQ(refusal("x = [0.28, nan]", count),
            "m.toml:1: key 'x' = [0.28, nan]: must be a whole number within [0, 10]");
  EXPECT_EQ(refusal("[[hydraulics]]\n[[hydraulics]]", ask_for_relief),
            "m.toml:1: key 'hydraulics' = an array of 2 tables: must be a table, [hydraulics]");
  EXPECT_EQ(refusal("[[node]]\nchannels = ['x']",
                    [](TomlTable& file) {
                      for (TomlTable& node : file.tables("node")) (void)node.table("channels");
                    }),
            "m.toml:2: key 'node[0].channels' = ['x']: must be a table, { ... }");
  EXPECT_FALSE(test::says(refusal("x = \"\"\"a\nb\"\"\"", count), "\n"));
  EXPECT_EQ(refusal("", [](TomlTable& file) { file.require(false, "x", "at least one is needed"); }),
            "m.toml:1: key 'x': at least one is needed");
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
  EXPECT_EQ(refusal("x = 1\n  y = = 2\r\n", ask_for_x),
            "m.toml:2:7: 'y = = 2': Error while parsing value: could not determine value type");
  EXPECT_EQ(refusal("y = [1,\n", ask_for_x),
            "m.toml:1:9: 'y = [1,': Error while parsing array: encountered end-of-file");
  EXPECT_EQ(
      refusal("x = 1e999", ask_for_x),
      "m.toml:1:10: 'x = 1e999': Error while parsing floating-point: '1e999' could not be interpreted as a value: "
      "must be within [-1.8e308, 1.8e308]");
  EXPECT_NE(refusal("x = 1\nx = 2", ask_for_x), "accepted") << "a key given twice";
  EXPECT_NE(refusal(std::string("x = 1 # \xff\xfe"), ask_for_x), "accepted") << "not UTF-8";
}

TEST(TomlReader, ShowsControlCharactersAndShortensWhatIsLong) {
  EXPECT_EQ(refusal("x = 1\n\"\\u001b[31m\" = 2", ask_for_x),
            "m.toml:2: key '\\x1b[31m' = 2: unknown key" + kOrMisplaced);
  EXPECT_EQ(refusal(std::string(100'000, 'k') + " = 2\nx = 1", ask_for_x),
            "m.toml:1: key '" + std::string(60, 'k') + "... (100000 characters)' = 2: unknown key" + kOrMisplaced);
  EXPECT_EQ(refusal("x = '" + std::string(100'000, 'v') + "'", ask_for_x),
            "m.toml:1: key 'x' = '" + std::string(59, 'v') + "... (100002 characters): must be a number within [0, 1]");
}

TEST(TomlReader, TextsHoldNothingThatATerminalObeys) {
  const auto ask = [](TomlTable& file) { (void)file.text("x"); };
  EXPECT_EQ(refusal("x = \"K\\u00fcbel 3\"", ask), "accepted");
  for (const char* text : {"a\\u001b[2J", "a\\nb", "a\\u009b2J", "a\\u202eb"}) {
    const std::string line = refusal(std::string("x = \"") + text + "\"", ask);
    EXPECT_TRUE(test::says(line, "must be at most 1000 characters, none of them a control character"));
    EXPECT_EQ(printable(line), line);
  }
  EXPECT_NE(refusal("x = '" + std::string(1001, 'v') + "'", ask), "accepted");
}

std::string repeated(const std::string& what, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += what;
  return all;
}

TEST(TomlReader, BoundsTheNamesInAKey) {
  const auto leave = [](TomlTable& file) { file.leave("a"); };
  for (const char* form :
       {"%s = 1", "[%s]", "[[%s]]", "[ %s ]\nb = 1.5", "a = { %s = 1 }", "a = [\n{%s = [0.1, 0.2]}]"}) {
    const auto with = [&](const std::string& key) {
      std::string text = form;
      return text.replace(text.find("%s"), 2, key);
    };
    SCOPED_TRACE(form);
    EXPECT_EQ(refusal(with("a" + repeated(".a", 15)), leave), "accepted");
    const std::string line = refusal(with("a" + repeated(".a", 16)), leave);
    EXPECT_TRUE(test::says(line, ": key 'a" + repeated(".a", 16) + "': must be at most 16 names joined by dots"));
    EXPECT_NE(refusal(with("a" + repeated(R"( . "#\"=\n,]" . '[")", 8) + "'"), leave), "accepted");
    EXPECT_NE(refusal(with("a" + repeated(".a", 200'000)), leave), "accepted");
  }
}

TEST(TomlReader, BoundsHowDeepValuesNest) {
  const auto leave = [](TomlTable& file) { file.leave("a"); };
  struct Form {
    const char *open, *close;
    int most = 16;
  };
  for (const Form& form :
       {Form{"[", "]"}, Form{"{a=", "}"}, Form{"[{a=", "}]", 8}, Form{"[#]]\n", "]"}, Form{R"(["]\"",)", "]"}}) {
    const auto nested = [&](int times) {
      return "a = " + repeated(form.open, times) + "1" + repeated(form.close, times);
    };
    SCOPED_TRACE(form.open);
    EXPECT_EQ(refusal(nested(form.most), leave), "accepted");
    EXPECT_TRUE(test::says(refusal(nested(form.most + 1), leave), "must be at most 16 deep"));
    EXPECT_NE(refusal(nested(100'000), leave), "accepted");
  }
}

int depth_of(const toml::node& node) {
  int below = 0;
  if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) below = std::max(below, depth_of(value));
  } else if (const auto* array = node.as_array()) {
    for (const toml::node& value : *array) below = std::max(below, depth_of(value));
  }
  return below + 1;
}

/// Mostly valid TOML of what is easily mistaken: quotes, escapes, brackets and keys of many names in strings, comments
/// and keys.
class TrickyText {
 public:
  explicit TrickyText(std::uint64_t seed) : random_(seed) {}

  std::string next() {
    std::string text;
    for (auto left = 1 + below(4); left > 0; --left) {
      text += one_of({"", "", "\n", " # " + noise("\n") + "\n"});
      text += one_of({key() + " = " + value() + "\n", key() + " = " + value() + " # " + noise("\n") + "\r\n",
                      "[" + key() + "]\n", "[[ " + key() + " ]]\n"});
    }
    return text;
  }

 private:
  std::size_t below(std::size_t count) { return random_() % count; }
  std::string one_of(const std::vector<std::string>& choices) { return choices[below(choices.size())]; }
  std::string noise(const std::string& without) {
    static const std::string many = "a" + repeated(".a", 400);
    std::string text;
    for (auto left = below(6); left > 0; --left)
      text += one_of({"\"", "'", "\"\"\"", "'''", "\\", "#", "[", "{", "]", "=", "\n", " ", many});
    std::erase_if(text, [&](char c) { return without.find(c) != std::string::npos; });
    return text;
  }
  std::string quoted() {
    return one_of(
        {"\"" + noise("\"\\\n") + "\"", "'" + noise("'\n") + "'", "\"\\\"" + noise("\"\\\n") + "\\\\\"", "\"\""});
  }
  std::string key() {
    const std::string name = "k" + std::to_string(below(1000));
    return below(8) > 0 ? one_of({name, quoted(), name + " . " + quoted()})
                        : name + repeated(one_of({".a", " . '.'", ".\"\\\"\""}), 400);
  }
  std::string value() {
    switch (below(6)) {
      case 0:
        return "{" + key() + " = " + value() + one_of({"", ", " + key() + "= 1.5"}) + "}";
      case 1:
        return "[" + value() + "," + one_of({"", "\n#" + noise("\n") + "\n"}) + value() + "]";
      case 2:
        return "\"\"\"" + one_of({"", "\n", "\""}) + noise("\"\\") + one_of({"", "\\\n", "\"", "\"\""}) + "\"\"\"";
      case 3:
        return "'''" + noise("'") + one_of({"", "'", "''"}) + "'''";
      case 4:
        return quoted();
      default:
        return one_of({"1", "1.5", "1979-05-27T07:32:00.5", noise("\n")});
    }
  }

  std::mt19937_64 random_;
};

/// The check and toml++ agree on what is a key, whatever opens or closes strings and comments around it.
TEST(TomlReader, RefusesAsTooDeepWhatTheParserWouldMakeADeepTreeOfAndNothingElse) {
  constexpr int kBound = 1 + 2 * 16 + 17 * 16;  // levels that the check allows at most
  TrickyText tricky(20);
  int deep = 0, flat = 0;
  for (int round = 0; round < 5000; ++round) {
    const std::string text = tricky.next();
    int depth = 0;
    try {
      depth = depth_of(toml::parse(text));
    } catch (const toml::parse_error&) {
      continue;
    }
    const bool refused = refusal(text, [](TomlTable&) {}).find("must be at most 16") != std::string::npos;
    ++(refused ? deep : flat);
    EXPECT_TRUE(refused ? depth > 16 : depth <= kBound) << depth << " levels:\n" << text;
  }
  EXPECT_GT(deep, 500);
  EXPECT_GT(flat, 500);
}

std::vector<std::string> all_errors(const std::string& text, const std::function<void(TomlTable&)>& reader) {
  try {
    TomlTable file = TomlTable::parse(text, "m.toml");
    reader(file);
    file.finish();
  } catch (const FileErrors& errors) {
    return errors.lines();
  }
  return {};
}
using Lines = std::vector<std::string>;

TEST(TomlReader, FindsAllThatIsWrongInOneReadingByLine) {
  const auto read = [](TomlTable& file) {
    const double high = file.number("high", 0, 9), low = file.number("low", 0, 9);
    file.require(low < high, "low", "must be below high", {"high"});
    (void)file.text("name");
    (void)file.boolean("on");
    (void)file.choice("mount", {"hull", "boom"});
    (void)file.table("gone").integer("count", 1, 5);
    for (TomlTable& wall : file.tables("wall")) (void)wall.numbers<2>("at", 0, 1);
  };
  EXPECT_EQ(all_errors("low = 5\nhigh = 4\nnmae = 'x'\nother = 1\n[[wall]]\nat = [0, 2]\n[[wall]]\nat = 1", read),
            (Lines{"m.toml:1: key 'low' = 5: must be below high", "m.toml:1: key 'on' is missing",
                   "m.toml:1: key 'mount' is missing", "m.toml:1: key 'gone' is missing",
                   "m.toml:3: key 'name' is missing; is 'nmae' here meant to be it?",
                   "m.toml:4: key 'other' = 1: unknown key" + kOrMisplaced,
                   "m.toml:6: key 'wall[0].at' = [0, 2]: must be 2 numbers within [0, 1]",
                   "m.toml:8: key 'wall[1].at' = 1: must be 2 numbers within [0, 1]"}));
}

TEST(TomlReader, OneMistakeIsOneErrorWhateverHangsOnIt) {
  const auto read = [](TomlTable& file) {
    const double high = file.number("high", 1, 9), low = file.number("low", 1, 9);
    file.require(low < high, "low", "must be below high", {"high"});
    TomlTable valve = file.table("valve");
    valve.require(valve.number("flow", 0, 9) > low, "flow", "must be above low", {".low"});
  };
  EXPECT_EQ(all_errors("high = 99\nlow = 5\n[valve]\nflow = 6", read),
            Lines{"m.toml:1: key 'high' = 99: must be within [1, 9]"});
  EXPECT_EQ(all_errors("high = 7\nlow = 'five'\n[valve]\nflow = 0.5", read),
            Lines{"m.toml:2: key 'low' = 'five': must be a number within [1, 9]"});
  EXPECT_EQ(all_errors("high = 7\nlow = 5\nvalve = 3", read),
            Lines{"m.toml:3: key 'valve' = 3: must be a table, [valve]"});
}

TEST(TomlReader, WhereTheChoiceIsWrongItsKeysAreNeitherMissedNorUnknown) {
  const auto read = [](TomlTable& file) {
    const int kind = file.choice("kind", {"wall", "soil"});
    if (!file.sound({"kind"})) return file.leave_rest();
    (void)file.number(kind == 0 ? "stiffness" : "density", 0, 9);
  };
  EXPECT_EQ(all_errors("kind = 'siol'\ndensity = 3", read),
            Lines{"m.toml:1: key 'kind' = 'siol': must be one of \"wall\", \"soil\""});
}

TEST(TomlReader, AMisspeltKeyIsReadAsTheOneItWasMeantToBe) {
  EXPECT_EQ(all_errors("[hydraulics]\nmain_releif_bar = 900", ask_for_relief),
            (Lines{"m.toml:2: key 'hydraulics.main_relief_bar' is missing; is 'main_releif_bar' here meant to be it?",
                   "m.toml:2: key 'hydraulics.main_relief_bar' = 900: must be within [50, 400]"}));
}

TEST(TomlReader, TheFirstOfManyErrorsSaysHowManyThereAre) {
  EXPECT_EQ(refusal("x = 2\ny = 1\nz = 3", ask_for_x),
            "m.toml:1: key 'x' = 2: must be within [0, 1] (first of 3 errors; knuckle check shows all)");
  std::string junk;
  for (int i = 0; i < 100'000; ++i) junk += "k" + std::to_string(i) + " = 1\n";
  EXPECT_EQ(all_errors(junk, ask_for_x).size(), 100U);
}

TEST(TomlReader, UnreadableFilesAreNamed) {
  for (const std::string path : {"/nowhere/m.toml", "/tmp"}) {
    const std::string said = test::refusal([&] { (void)TomlTable::read(path); });
    EXPECT_TRUE(test::begins(said, path + ": cannot be read: "));
  }
}

}  // namespace
}  // namespace knuckle
