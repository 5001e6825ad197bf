// Whole sessions of machines with two buses: one cut, one bus-off, both flooded. Commands and spools neutral within the
// bounds of config/scenarios/bus_faults.toml, nothing that moves by itself, and the reason names the bus.
#include "tests/support/two_buses.h"

#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::test {
namespace {

constexpr double kCommandNeutral_s = 0.2, kSpoolNeutral_s = 0.32;

struct Machine {
  MachineDescription description;
  std::string device;
};
Machine nodes() {
  return {parse_machine(two_buses_text(), "m.toml"), "knuckle1"};
}
/// Commands on the first bus; what it sends on the second.
Machine own_controller() {
  const std::string text = whole_file(source_dir() + "/config/machines/standard200.toml", 1);
  return {parse_machine(on_two_buses(text), "m.toml"), "knuckle1_standard200"};
}

std::string fault_text(const std::string& kind, const std::string& bus) {
  return "[[fault]]\nkind = \"" + kind + "\"\nphase = \"moving\"\nafter_s = 2.3\nduration_s = 0.6\nbus = \"" + bus +
         "\"\n";
}

void expect_neutral_and_named(const Machine& machine, const std::string& kind, const std::string& bus) {
  const MachineDescription& read = machine.description;
  const FinishedSession finished = run_broken_while_moving(read, machine.device, fault_text(kind, bus), 4);
  const std::string code = kind == "bus_cut" ? "bus_passive" : "bus_off";
  const std::string about = read.name + ", " + kind + " of " + bus;
  ASSERT_EQ(finished.record.faults.size(), 1U) << about;
  const session::FaultRecord& fault = finished.record.faults.front();
  EXPECT_TRUE(begins(text_with_code(fault.reason, read.bus), code + ": bus " + bus + ": ")) << about;
  EXPECT_LE(fault.at_s - fault.injected_s.value_or(0), 0.02) << about;
  if (!fault.controller_silent) {
    EXPECT_GT(fault.command_neutral_s, 0) << about;
    EXPECT_LE(fault.command_neutral_s - fault.last_good_input_s, kCommandNeutral_s) << about;
  }
  EXPECT_GT(fault.spool_neutral_s, 0) << about;
  EXPECT_LE(fault.spool_neutral_s - fault.last_good_input_s, kSpoolNeutral_s) << about;
  expect_led_again(finished, about);
}

TEST(TwoBuses, OneCutOrOffIsNeutralWithinBoundsAndNamed) {
  expect_neutral_and_named(nodes(), "bus_cut", "valves");
  expect_neutral_and_named(nodes(), "bus_off", "machine");
  expect_neutral_and_named(own_controller(), "bus_off", "valves");
  expect_neutral_and_named(own_controller(), "bus_cut", "machine");
}

TEST(DeepTwoBuses, EitherCutOrOffIsNeutralWithinBoundsAndNamed) {
  for (const Machine& machine : {nodes(), own_controller()})
    for (const char* kind : {"bus_cut", "bus_off"})
      for (const char* bus : {"valves", "machine"}) expect_neutral_and_named(machine, kind, bus);
}

TEST(TwoBuses, BothFloodedAsFullAsTheyCanBeStillCarryWhatCounts) {
  for (const Machine& machine : {nodes(), own_controller()}) {
    const MachineDescription& read = machine.description;
    const FinishedSession finished = run_broken_while_moving(
        read, machine.device, fault_text("babble", "valves") + fault_text("babble", "machine"), 4);
    EXPECT_TRUE(finished.record.faults.empty()) << text_with_code(finished.record.faults.front().reason, read.bus);
    int strangers = 0, on_second = 0;
    Time before{};
    for (const TimedFrame& f : finished.frames) {
      EXPECT_GE(f.at, before);
      before = f.at;
      strangers += f.frame.id == 0x001 ? 1 : 0;
      on_second += f.frame.id == (0x001U | kSecondBus) ? 1 : 0;
    }
    EXPECT_GT(strangers, 500) << read.name;
    EXPECT_GT(on_second, 500) << read.name;
  }
}

TEST(TwoBuses, AFaultOfABusNamesWhich) {
  const MachineDescription machine = parse_machine(two_buses_text(), "m.toml");
  const auto refused = [&](const std::string& kind, const std::string& bus) {
    const std::string scenario = broken_while_moving(fault_text(kind, bus), 4);
    return refusal([&] { return session::parse_scenario(scenario, "s.toml", machine); });
  };
  EXPECT_EQ(refused("bus_off", "machine"), "accepted");
  EXPECT_TRUE(says(refused("bus_off", "tracks"), "'fault[0].bus' = 'tracks': must be one of valves, machine"));
  EXPECT_TRUE(says(refused("e_stop", "machine"), "unknown key"));
}

}  // namespace
}  // namespace knuckle::test
