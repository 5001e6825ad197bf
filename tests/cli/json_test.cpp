// What results are written with: the same text as from nlohmann's value of the same braces.
#include "app/cli/json.h"

#include <gtest/gtest.h>

#include <limits>

namespace knuckle::cli {
namespace {

TEST(Json, ValuesAreWrittenAsTheyAre) {
  const std::pair<Json, const char*> table[] = {
      {{}, "null"},
      {nullptr, "null"},
      {true, "true"},
      {-3, "-3"},
      {std::uint8_t{200}, "200"},
      {std::numeric_limits<std::uint64_t>::max(), "18446744073709551615"},
      {std::numeric_limits<std::int64_t>::min(), "-9223372036854775808"},
      {0.1, "0.1"},
      {2.0, "2.0"},
      {std::numeric_limits<double>::quiet_NaN(), "null"},
      {std::numeric_limits<double>::infinity(), "null"},
      {"a \"quoted\"\nline", R"("a \"quoted\"\nline")"},
      {std::string_view("view"), R"("view")"},
      {std::optional<int>(), "null"},
      {std::optional<double>(0.5), "0.5"},
      {std::vector<std::string>{"a", "b"}, R"(["a","b"])"},
      {std::vector<double>(), "[]"},
      {std::array<double, 2>{1, 2.5}, "[1.0,2.5]"},
      {Json::array(), "[]"},
      {Json::object(), "{}"},
  };
  for (const auto& [json, text] : table) EXPECT_EQ(json.dump(), text);
}

TEST(Json, BracesMakeObjectsOfPairsThatBeginWithAKeyAndArraysOfAnythingElse) {
  EXPECT_EQ((Json{{"seed", 7}, {"passed", nullptr}, {"at", {{"s", 1.5}}}}).dump(),
            R"({"seed":7,"passed":null,"at":{"s":1.5}})");
  EXPECT_EQ((Json{{"text", "value"}}).dump(), R"({"text":"value"})");
  EXPECT_EQ((Json{1, 2, "three"}).dump(), R"([1,2,"three"])");
  EXPECT_EQ((Json{{1, 2}, {"low", 3}}).dump(), R"([[1,2],["low",3]])");
}

TEST(Json, ObjectsKeepTheOrderInWhichTheyWereFilledAndWhatCameLast) {
  Json json{{"z", 1}, {"a", 2}};
  json["m"]["deep"] = 3;
  json["list"].push_back({{"k", 4}});
  json["list"].push_back(5);
  json.update({{"a", "new"}, {"b", 6}});
  json.update(Json());
  EXPECT_EQ(json.dump(), R"({"z":1,"a":"new","m":{"deep":3},"list":[{"k":4},5],"b":6})");
  EXPECT_EQ((Json{{"a", {1}}}).dump(1), "{\n \"a\": [\n  1\n ]\n}");
}

TEST(Json, TextThatIsNotUtf8EndsNoProgram) {
  EXPECT_EQ(Json("\xff"
                 "a")
                .dump(),
            "\"\xEF\xBF\xBD"
            "a\"");
  EXPECT_EQ(Json("\xc3\xa4").dump(), "\"\xc3\xa4\"");
  EXPECT_EQ(Json("\xc3\xa4").dump_ascii(), R"("\u00e4")");
}

}  // namespace
}  // namespace knuckle::cli
