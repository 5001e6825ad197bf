// Valves of simulated machines, found from ordinary motion.
#include "estimation/identification/valve_identification.h"

#include <gtest/gtest.h>

#include "app/commissioning/machine_run.h"
#include "estimation/identification/excitation.h"
#include "machine/load.h"

namespace knuckle::app {
namespace {

TEST(ValveIdentification, FindsTheValvesOfDrawnMachines) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const estimation::JointPath sweeps = estimation::slow_sweeps(machine, 40);
  for (const std::uint64_t seed : {3U, 7U}) {
    const sim::MachineTruth truth = sim::draw_truth(machine, seed);
    MachineRun run(machine, truth, {}, sweeps.joint_rad.front(), seed);
    const std::array recordings{run.follow(sweeps).recording};
    const estimation::ValveResult result = estimation::identify_valves(machine, recordings);
    for (std::size_t joint = 0; joint < kJoints; ++joint) {
      const ValveDescription& real = truth.machine.cylinders[joint].valve;
      const ValveCalibration& found = result.valves[joint];
      EXPECT_TRUE(result.axes[joint].usable) << result.axes[joint].reasons.front();
      EXPECT_NEAR(found.dead_band_extend, real.dead_band_extend, 2.5e-3) << seed << " " << kJointNames[joint];
      EXPECT_NEAR(found.dead_band_retract, real.dead_band_retract, 2.5e-3) << seed << " " << kJointNames[joint];
      EXPECT_NEAR(found.nominal_flow_m3ps / real.nominal_flow_m3ps, 1, 0.03) << seed << " " << kJointNames[joint];
      EXPECT_NEAR(found.delay_s, real.delay_s, 9e-3) << seed << " " << kJointNames[joint];
    }
  }
}

}  // namespace
}  // namespace knuckle::app
