// What would fit where a bus is too full: each offer, written into the file, makes it one that is accepted.
#include "machine/bus_budget.h"

#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/few_nodes.h"
#include "tests/support/module_machine.h"
#include "tests/support/refused_changes.h"
#include "tests/support/shipped.h"

namespace knuckle::bus_budget {
namespace {

std::vector<std::string> split(const std::string& text, const std::string& by) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(by, at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = end + by.size();
  }
  return parts;
}

std::string text_of(const toml::table& machine) {
  std::ostringstream text;
  text << machine;
  return text.str();
}

/// key = value of [bus], or wire.key = value.
void set(toml::table& machine, const std::string& setting) {
  const toml::table one = toml::parse(setting);
  toml::table& bus = *machine["bus"].as_table();
  for (const auto& [key, value] : one) {
    if (!value.is_table()) {
      bus.insert_or_assign(key.str(), value);
      continue;
    }
    bus.insert("wire", toml::table{});
    for (const auto& [below, wire] : *value.as_table()) bus["wire"].as_table()->insert_or_assign(below.str(), wire);
  }
}

toml::table solar_with(const std::vector<std::string>& settings) {
  toml::table machine = toml::parse_file(test::shipped_file("solar015"));
  for (const std::string& setting : settings) set(machine, setting);
  return machine;
}

std::string refused(const toml::table& machine) {
  return test::machine_refusal(text_of(machine));
}
std::vector<std::string> offers(const toml::table& machine) {
  const std::string told = refused(machine), words = "; would fit: ";
  EXPECT_TRUE(test::says(told, "key 'bus.bit_rate_kbps'"));
  const auto at = told.find(words);
  return at == std::string::npos ? std::vector<std::string>() : split(told.substr(at + words.size()), ", or ");
}
TEST(BusBudget, EveryOfferIsAcceptedAndLoadsTheBusAsItSays) {
  const std::string digits = "wire.pressure_digits = 0";
  int tried = 0;
  for (const toml::table& machine :
       {solar_with({"bit_rate_kbps = 250"}), solar_with({"bit_rate_kbps = 125"}),
        solar_with({"valve_status_every_nth_sync = 1"}), solar_with({"sync_Hz = 250"}),
        solar_with({"bit_rate_kbps = 250", "wire.pressure_value = \"float\""}),
        solar_with({"bit_rate_kbps = 250", "wire.pressure_value = \"integer16\"", digits}),
        solar_with({"bit_rate_kbps = 250", "valve_watchdog_ms = 10", "sensor_age_limit_ms = 20"})}) {
    const std::vector<std::string> all = offers(machine);
    EXPECT_FALSE(all.empty());
    for (const std::string& offer : all) {
      const std::vector<std::string> parts = split(offer, " (");
      ASSERT_EQ(parts.size(), 2U) << offer;
      toml::table changed = machine;
      for (const std::string& first : split(parts[0], " with "))
        for (const std::string& setting : split(first, " and ")) set(changed, setting);
      ASSERT_EQ(refused(changed), "accepted") << offer;
      const double load = worst_bus_load(parse_machine(text_of(changed), "m.toml").bus);
      EXPECT_NEAR(100 * load, std::stod(parts[1]), 0.051) << offer;
      EXPECT_LE(load, kFullestBus) << offer;
      ++tried;
    }
  }
  EXPECT_GT(tried, 15);
}

TEST(BusBudget, OffersNoShorterPressuresWhereADeviceMapsThemByItself) {
  const MachineDescription machine = parse_machine(text_of(solar_with({})), "m.toml");
  BusDescription bus = machine.bus;
  bus.valve_status_every_nth_sync = 2;
  EXPECT_TRUE(test::says(what_fits(bus, machine.sensors), "integer16"));
  for (NodeDescription& node : bus.nodes) {
    if (node.id == machine.bus.pressure(0).id) node.tpdo_maps = {{0x91300120, 0x61500108}};
  }
  EXPECT_FALSE(test::says(what_fits(bus, machine.sensors), "integer16"));
}

TEST(BusBudget, OffersAModuleSlowerFrames) {
  const MachineDescription machine = parse_machine(test::module_text(), "m.toml");
  const double others = (0.66 - worst_bus_load(machine.bus)) * machine.bus.bit_rate;
  const std::string fits = what_fits(machine.bus, machine.sensors, others);
  EXPECT_TRUE(test::says(fits, "sync_Hz = "));
  // At half the rate a module's frames are half as many.
  BusDescription slow = machine.bus;
  slow.sync_Hz = 100;
  for (BroadcastFrame& frame : slow.broadcasts) frame.period_s = 0.01;
  for (CommandFrame& frame : slow.commands) frame.period_s = 0.01;
  const double at_100 = worst_bus_load(slow) + others / slow.bit_rate;
  const double more = (0.6 - at_100) * slow.bit_rate - 500;
  EXPECT_TRUE(test::says(what_fits(machine.bus, machine.sensors, others + more), "sync_Hz = 100 with"));
}

TEST(BusBudget, OffersAModulesInputsOnItsFirstChannels) {
  MachineDescription machine = parse_machine(test::module_text(), "m.toml");
  auto& frames = machine.bus.broadcasts;
  ASSERT_EQ(frames.size(), 3U);
  for (BroadcastFrame& frame : frames) frame.fields.resize(1);
  const double others = (0.6 - worst_bus_load(machine.bus)) * machine.bus.bit_rate + 20e3;
  const std::string fits = what_fits(machine.bus, machine.sensors, others);
  EXPECT_TRUE(test::says(fits, "the inputs of 'module' on its channels 1 to 3 ("));
}

TEST(BusBudget, WhatOthersSendIsCountedAndWhereNothingFitsNothingIsOffered) {
  const MachineDescription machine = parse_machine(test::few_nodes_text(), "few.toml");
  const auto fits = [&](double others) { return what_fits(machine.bus, machine.sensors, others); };
  EXPECT_TRUE(test::says(fits(20e3), "bit_rate_kbps = 500"));
  EXPECT_TRUE(test::says(fits(300e3), "bit_rate_kbps = 800"));
  EXPECT_EQ(fits(1e6), "");
}

}  // namespace
}  // namespace knuckle::bus_budget
