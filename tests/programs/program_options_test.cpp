// What the programs' result files have in common.
#include "app/programs/program_options.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/places.h"

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
  for (const auto& [key, value] : json.items()) EXPECT_NE(document.find("`" + key + "`"), std::string::npos) << key;
}

TEST(ProgramOptions, WhatWasNeverMeasuredIsNull) {
  Histogram round_trip;
  EXPECT_EQ(milliseconds_json(round_trip).dump(), "null");
  round_trip.add(20ms);
  EXPECT_EQ(nlohmann::json::parse(milliseconds_json(round_trip).dump()).at("max"), 20);
}

}  // namespace
}  // namespace knuckle::programs
