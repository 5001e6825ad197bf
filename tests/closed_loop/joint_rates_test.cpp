// Machines that are led by joint speeds through their own controller, drawn: however far serviced and worn valves leave
// them behind, and whatever soil pushes their bucket, nobody takes that for a fault.
#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

TEST(JointRates, OfServicedAndWornMachinesAreNoFaultInFreeMotionOrPressing) {
  for (const char* const scenario : {"free_motion", "level"}) {
    for (const sim::Family family : {sim::Family::kServiced, sim::Family::kWorn}) {
      // Of 6 the soil pushes the serviced bucket through its relief.
      for (const std::uint64_t seed : {1U, 2U, 6U}) {
        session::SessionSetup setup;
        setup.machine = load_machine(find_config("machine", "standard200"));
        setup.device = load_device(find_config("device", "knuckle1_standard200"));
        setup.scenario = session::load_scenario(find_config("scenario", scenario), setup.machine);
        setup.truth = sim::sample_truth(setup.machine, family, seed);
        setup.limb = sim::sample_limb(setup.scenario.limb, seed);
        setup.to_machine.delay = setup.to_operator.delay = 1ms;
        setup.seed = seed;
        const session::SessionRecord record = run_session(setup).record;
        const std::string about = std::string(scenario) + ", " + name(family) + ", seed " + std::to_string(seed);
        EXPECT_TRUE(record.faults.empty())
            << about << ": " << text_with_code(record.faults.front().reason, setup.machine.bus);
        EXPECT_GT(record.samples.back().t_s, 30) << about;
      }
    }
  }
}

}  // namespace
}  // namespace knuckle::test
