// Machines that are led by joint speeds through their own controller, drawn: however far serviced and worn valves leave
// them behind, and whatever soil pushes their bucket, nobody takes that for a fault.
#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

/// Of the machines of that seed, serviced and worn.
void expect_no_fault(const char* scenario, std::uint64_t seed) {
  const MachineDescription machine = load_machine(find_config("machine", "standard200"));
  for (const sim::Family family : {sim::Family::kServiced, sim::Family::kWorn}) {
    session::SessionSetup setup =
        setup_of(machine, "knuckle1_standard200", session::load_scenario(find_config("scenario", scenario), machine),
                 seed, family);
    setup.machine = machine;  // as it comes, not calibrated
    const session::SessionRecord record = run_session(setup).record;
    const std::string about = std::string(scenario) + ", " + name(family) + ", seed " + std::to_string(seed);
    EXPECT_TRUE(record.faults.empty()) << about << ": " << text_with_code(record.faults.front().reason, machine.bus);
    EXPECT_GT(record.samples.back().t_s, 30) << about;
  }
}

// Of level's 6 the soil pushes the serviced bucket through its relief.
TEST(JointRates, OfServicedAndWornMachinesAreNoFaultInFreeMotionOrPressing) {
  expect_no_fault("free_motion", 1);
  expect_no_fault("level", 6);
}

TEST(DeepJointRates, OfMoreDrawnMachinesAreNoFaultInFreeMotionOrPressing) {
  for (const std::uint64_t seed : {2U, 6U}) expect_no_fault("free_motion", seed);
  for (const std::uint64_t seed : {1U, 2U}) expect_no_fault("level", seed);
}

}  // namespace
}  // namespace knuckle::test
