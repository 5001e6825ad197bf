// What an operator is told of a machine with two CAN buses while one of them fails alone: which, and how both are.
#include "tests/support/two_buses.h"

#include <gtest/gtest.h>

#include "machine/load.h"
#include "machine/reason_text.h"
#include "tests/console/far_rig.h"
#include "tests/support/says.h"

namespace knuckle::console {
namespace {

struct TwoBuses : test::FarRig {
  TwoBuses() : FarRig(two_buses_setup()) {}
  static session::SessionSetup two_buses_setup() {
    session::SessionSetup setup = test::live_setup();
    const MachineDescription machine = parse_machine(test::two_buses_text(), "m.toml");
    setup.truth = sim::sample_truth(machine, 1);
    setup.machine = calibrated(machine);
    return setup;
  }
  [[nodiscard]] VirtualCanBus& bus(std::size_t which) { return far.simulated.bus(which); }
  [[nodiscard]] std::string fault() const { return text_with_code(view.machine.fault, setup.machine.bus); }
};

struct BusFault {
  const char* name;
  CanState seen;
  void (*set)(VirtualCanBus& bus, bool broken);
};
constexpr BusFault kFaults[] = {
    {"cut", CanState::kPassive, [](VirtualCanBus& bus, bool on) { bus.disconnect(0, on); }},
    {"bus-off", CanState::kBusOff, [](VirtualCanBus& bus, bool on) { on ? bus.bus_off(0) : bus.recover(0); }},
    {"down", CanState::kDown, [](VirtualCanBus& bus, bool on) { bus.take_down(0, on); }}};

TEST(TwoBuses, TheOperatorSeesWhichIsInWhichStateAndTheLoadOfEach) {
  for (const BusFault& fault : kFaults) {
    for (const std::size_t broken : {0U, 1U}) {
      SCOPED_TRACE(std::string(fault.name) + ", " + std::to_string(broken));
      const std::size_t other = 1 - broken;
      TwoBuses rig;
      rig.run(3s);
      const double load = rig.view.status.buses[other].load;
      for (const MachineStatus::Bus& bus : rig.view.status.buses) {
        EXPECT_EQ(bus.state, CanState::kActive);
        EXPECT_GT(bus.load, 0.1);
      }
      fault.set(rig.bus(broken), true);
      rig.run(500ms);
      EXPECT_EQ(rig.view.status.buses[broken].state, fault.seen);
      EXPECT_LT(rig.view.status.buses[broken].load, 0.05);
      EXPECT_EQ(rig.view.status.buses[other].state, CanState::kActive);
      if (broken == 1) {
        EXPECT_NEAR(rig.view.status.buses[other].load, load, 0.05);
      }
      const std::string named = broken == 0 ? ": bus valves: " : ": bus machine: ";
      EXPECT_TRUE(test::says(rig.fault(), named));
    }
  }
}

/// Nothing is wrong with the controller then: the load says it, and the reason names the bus.
TEST(TwoBuses, TheOperatorSeesWhichIsSilent) {
  TwoBuses rig;
  rig.run(3s);
  rig.bus(1).silence(1, true);
  rig.run(500ms);
  EXPECT_EQ(rig.view.status.buses[1].state, CanState::kActive);
  EXPECT_EQ(rig.view.status.buses[1].load, 0);
  EXPECT_GT(rig.view.status.buses[0].load, 0.1);
  EXPECT_TRUE(test::says(rig.fault(), ", bus machine)"));
}

}  // namespace
}  // namespace knuckle::console
