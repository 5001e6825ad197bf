// What the programs' result files have in common.
#include "app/programs/program_options.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::programs {
namespace {

TEST(ProgramOptions, EveryCounterOfACanInterfaceIsInTheResultByTheNameThatItsDocumentGives) {
  const CanCounters counters{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const auto json = nlohmann::json::parse(counters_json(counters).dump());
  std::set<int> values;
  for (const auto& value : json) values.insert(value.get<int>());
  EXPECT_EQ(values.size(), 15U);
  EXPECT_EQ(json.at("protocol_errors"), counters.protocol_errors);
  EXPECT_EQ(json.at("receive_errors"), counters.receive_errors);
  std::ifstream file(test::source_dir() + "/docs/can-bus.md");
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  for (const auto& [key, value] : json.items()) EXPECT_TRUE(test::says(document, "`" + key + "`")) << key;
}

TEST(ProgramOptions, OtherOutputsAreKeptWhereTheDiskRefusesOne) {
  const test::TemporaryFolder folder;
  AskedOutput candump("--candump", "/dev/full"), json("--json", folder.file("run.json"));
  *candump.stream() << "(0.000000) can0 080#\n";
  *json.stream() << "{}\n";
  EXPECT_EQ(test::refusal([&] {
              commit_all({&candump, &json});
            }),
            "--candump /dev/full: cannot be written: No space left on device");
  EXPECT_EQ(test::content(folder.file("run.json")), "{}\n");
}

TEST(ProgramOptions, WhatWasNeverMeasuredIsNull) {
  Histogram round_trip;
  EXPECT_EQ(milliseconds_json(round_trip).dump(), "null");
  round_trip.add(20ms);
  EXPECT_EQ(nlohmann::json::parse(milliseconds_json(round_trip).dump()).at("max"), 20);
}

}  // namespace
}  // namespace knuckle::programs
