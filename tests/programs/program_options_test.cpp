// What the programs' result files have in common.
#include "app/programs/program_options.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/support/places.h"

namespace knuckle::programs {
namespace {

TEST(ProgramOptions, EveryCounterOfACanInterfaceIsInTheResultByTheNameThatItsDocumentGives) {
  const CanCounters counters{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const auto json = counters_json(counters);
  int next = 1;
  for (const auto& value : json) EXPECT_EQ(value, next++);
  EXPECT_EQ(next, 16);
  EXPECT_EQ(json.at("protocol_errors"), counters.protocol_errors);
  EXPECT_EQ(json.at("receive_errors"), counters.receive_errors);
  std::ifstream file(test::source_dir() + "/docs/can-bus.md");
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  for (const auto& [key, value] : json.items()) EXPECT_NE(document.find("`" + key + "`"), std::string::npos) << key;
}

TEST(ProgramOptions, WhatWasNeverMeasuredIsNull) {
  Histogram round_trip;
  EXPECT_TRUE(milliseconds_json(round_trip).is_null());
  round_trip.add(20ms);
  EXPECT_EQ(milliseconds_json(round_trip).at("max"), 20);
}

}  // namespace
}  // namespace knuckle::programs
