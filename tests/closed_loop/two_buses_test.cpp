// Whole sessions of machines with two buses: one cut, one bus-off, both flooded. Commands and spools neutral within the
// bounds of config/scenarios/bus_faults.toml, nothing that moves by itself, and the reason names the bus.
#include "tests/support/two_buses.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

constexpr double kCommandNeutral_s = 0.2, kSpoolNeutral_s = 0.32;

struct Machine {
  std::string text, device;
};
Machine nodes() {
  return {two_buses_text(), "knuckle1"};
}
/// Commands on the first bus; what it sends on the second.
Machine own_controller() {
  return {on_two_buses(whole_file(source_dir() + "/config/machines/standard200.toml", 1)), "knuckle1_standard200"};
}

std::string fault_text(const std::string& kind, const std::string& bus) {
  return "[[fault]]\nkind = \"" + kind + "\"\nphase = \"moving\"\nafter_s = 2.3\nduration_s = 0.6\nbus = \"" + bus +
         "\"\n";
}

FinishedSession run(const Machine& machine, const std::string& faults, MachineDescription& read) {
  session::SessionSetup setup;
  read = parse_machine(machine.text, "m.toml");
  setup.device = load_device(find_config("device", machine.device));
  setup.scenario = session::parse_scenario(broken_while_moving(faults, 4), "s.toml", read);
  setup.truth = sim::sample_truth(read, 1);
  setup.machine = calibrated(read);
  setup.limb = sim::sample_limb(setup.scenario.limb, 1);
  setup.to_machine.delay = setup.to_operator.delay = 1ms;
  setup.seed = 1;
  return run_session(setup);
}

TEST(TwoBuses, OneCutOrOffIsNeutralWithinBoundsAndNamed) {
  for (const Machine& machine : {nodes(), own_controller()}) {
    for (const auto& [kind, code] : {std::pair{"bus_cut", "bus_passive"}, {"bus_off", "bus_off"}}) {
      for (const std::string bus : {"valves", "machine"}) {
        MachineDescription read;
        const FinishedSession finished = run(machine, fault_text(kind, bus), read);
        const std::string about = read.name + ", " + kind + " of " + bus;
        ASSERT_EQ(finished.record.faults.size(), 1U) << about;
        const session::FaultRecord& fault = finished.record.faults.front();
        EXPECT_EQ(text_with_code(fault.reason, read.bus).rfind(std::string(code) + ": bus " + bus + ": ", 0), 0U)
            << about << ": " << text_with_code(fault.reason, read.bus);
        EXPECT_LE(fault.at_s - fault.injected_s.value_or(0), 0.02) << about;
        if (!fault.controller_silent) {
          EXPECT_GT(fault.command_neutral_s, 0) << about;
          EXPECT_LE(fault.command_neutral_s - fault.last_good_input_s, kCommandNeutral_s) << about;
        }
        EXPECT_GT(fault.spool_neutral_s, 0) << about;
        EXPECT_LE(fault.spool_neutral_s - fault.last_good_input_s, kSpoolNeutral_s) << about;
        EXPECT_EQ(finished.record.resumed_by_itself, 0) << about;
        EXPECT_EQ(finished.record.samples.back().phase, 3) << about << ": led again";
        EXPECT_EQ(finished.allocations, 0U) << about;
      }
    }
  }
}

TEST(TwoBuses, BothFloodedAsFullAsTheyCanBeStillCarryWhatCounts) {
  for (const Machine& machine : {nodes(), own_controller()}) {
    MachineDescription read;
    const FinishedSession finished =
        run(machine, fault_text("babble", "valves") + fault_text("babble", "machine"), read);
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
  const auto refused = [&](const std::string& fault) {
    try {
      (void)session::parse_scenario(broken_while_moving(fault, 4), "s.toml", machine);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused(fault_text("bus_off", "machine")), "");
  EXPECT_NE(refused(fault_text("bus_off", "tracks")).find("'fault[0].bus' = 'tracks': must be one of valves, machine"),
            std::string::npos);
  EXPECT_NE(refused(fault_text("e_stop", "machine")).find("unknown key"), std::string::npos);
}

}  // namespace
}  // namespace knuckle::test
