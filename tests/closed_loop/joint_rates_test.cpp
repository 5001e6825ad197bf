// Machines that are led by joint speeds through their own controller, drawn: however far serviced and worn valves leave
// them behind, and whatever soil pushes their bucket, nobody takes that for a fault.
#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

TEST(JointRates, OfServicedAndWornMachinesAreNoFaultInFreeMotionOrPressing) {
  const MachineDescription machine = load_machine(find_config("machine", "standard200"));
  // Of level's 6 the soil pushes the serviced bucket through its relief.
  for (const auto& [scenario, seed] : {std::pair{"free_motion", 1U}, {"level", 6U}}) {
    for (const sim::Family family : {sim::Family::kServiced, sim::Family::kWorn}) {
      session::SessionSetup setup =
          setup_of(machine, "knuckle1_standard200", session::load_scenario(find_config("scenario", scenario), machine),
                   seed, family);
      setup.machine = machine;  // as it comes, not calibrated
      const session::SessionRecord record = run_session(setup).record;
      const std::string about = std::string(scenario) + ", " + name(family);
      EXPECT_TRUE(record.faults.empty()) << about << ": " << text_with_code(record.faults.front().reason, machine.bus);
      EXPECT_GT(record.samples.back().t_s, 30) << about;
    }
  }
}

}  // namespace
}  // namespace knuckle::test
