// Valves of simulated machines, found from ordinary motion.
#include "estimation/identification/valve_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "app/motion/machine_run.h"
#include "estimation/identification/excitation.h"
#include "machine/load.h"

namespace knuckle::identify {
namespace {

TEST(ValveIdentification, FindsTheValvesOfADrawnMachine) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const estimation::JointPath sweeps = estimation::slow_sweeps(machine, 40);
  const sim::MachineTruth truth = sim::sample_truth(machine, 7);
  motion::MachineRun run(machine, truth, {}, sweeps.joint_rad.front(), 7);
  const estimation::ValveResult result = estimation::identify_valves(machine, std::array{run.follow(sweeps).recording});
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    const ValveDescription& real = truth.machine.cylinders[joint].valve;
    const ValveCalibration& found = result.valves[joint];
    EXPECT_TRUE(result.axes[joint].usable) << result.axes[joint].reasons.front();
    EXPECT_NEAR(found.dead_band_extend, real.dead_band_extend, 2.5e-3) << kJointNames[joint];
    EXPECT_NEAR(found.dead_band_retract, real.dead_band_retract, 2.5e-3) << kJointNames[joint];
    EXPECT_NEAR(found.nominal_flow_m3ps / real.nominal_flow_m3ps, 1, 0.03) << kJointNames[joint];
    EXPECT_NEAR(found.delay_s, real.delay_s, 9e-3) << kJointNames[joint];
  }
}

/// Sum over machines and axes of what is found against the truth.
struct Tally {
  double squares = 0;
  int count = 0, covered = 0;
  void add(double error, double sigma) {
    squares += error * error;
    covered += std::abs(error) <= 1.96 * sigma ? 1 : 0;
    ++count;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
};

TEST(DeepValveIdentification, HoldsItsErrorsAndIntervalsOverDrawnMachines) {
  for (const char* name : {"solar015", "compact080"}) {
    const MachineDescription machine = load_machine(find_config("machine", name));
    const estimation::JointPath slow = estimation::slow_sweeps(machine, 60);
    const estimation::JointPath fast = estimation::fast_excitation(machine, 40);
    Tally dead_band, delay_s, gain;
    for (std::uint64_t seed = 101; seed <= 110; ++seed) {
      const sim::MachineTruth truth = sim::sample_truth(machine, seed);
      motion::MachineRun run(machine, truth, {}, slow.joint_rad.front(), seed);
      std::array<estimation::Recording, 2> recordings{run.follow(slow).recording, run.follow(fast).recording};
      const estimation::ValveResult result = estimation::identify_valves(machine, recordings);
      for (std::size_t joint = 0; joint < kJoints; ++joint) {
        const ValveDescription& real = truth.machine.cylinders[joint].valve;
        const auto& found = result.axes[joint].parameters;
        ASSERT_TRUE(result.axes[joint].usable) << result.axes[joint].reasons.front();
        dead_band.add(found[0].value - real.dead_band_extend, found[0].sigma);
        dead_band.add(found[1].value - real.dead_band_retract, found[1].sigma);
        delay_s.add(found[2].value - real.delay_s, found[2].sigma);
        gain.add(found[3].value / real.nominal_flow_m3ps - 1, found[3].sigma / real.nominal_flow_m3ps);
      }
    }
    std::cout << name << ": RMS errors dead band " << dead_band.rms() << ", delay " << 1e3 * delay_s.rms()
              << " ms, gain " << 100 * gain.rms() << " %; in their 95 % intervals " << dead_band.covered << " of "
              << dead_band.count << ", " << delay_s.covered << " of " << delay_s.count << ", " << gain.covered << " of "
              << gain.count << '\n';
    EXPECT_LT(dead_band.rms(), 1e-3);
    EXPECT_LT(delay_s.rms(), 5e-3);
    EXPECT_LT(gain.rms(), 0.015);
    for (const Tally& tally : {dead_band, delay_s, gain}) EXPECT_GE(tally.covered, 0.85 * tally.count);
  }
}

}  // namespace
}  // namespace knuckle::identify
