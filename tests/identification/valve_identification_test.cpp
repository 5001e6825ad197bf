// Refusals of the valve fit; what it finds is held against simulated machines in tests/commissioning.
#include "estimation/identification/valve_identification.h"

#include <gtest/gtest.h>

#include <cmath>

#include "machine/load.h"

namespace knuckle::estimation {
namespace {

/// A machine whose valves are exactly the model, without spool dynamics: cylinders go to and fro.
Recording recording(const MachineDescription& machine, double dead_band, double gain_factor, bool retracts) {
  Recording result{"made up", 0.005, {}, {}, {}};
  Measurement now;
  for (int joint = 0; joint < kJoints; ++joint) now.cylinder_m[joint] = 0.95;
  now.pressure_Pa.fill(12e5);
  for (int i = 0; i < 4000; ++i) {
    // The spool's lag is short beside the ten seconds of a period; what is left of it counts as delay.
    const double wave = std::sin(2 * M_PI * i * 0.005 / 10);
    const double command = retracts ? 0.25 * wave : 0.25 * std::abs(wave);
    for (int joint = 0; joint < kJoints; ++joint) {
      const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
      const double opening = std::max(0.0, std::abs(command) - dead_band) / (1 - dead_band);
      const double flow = gain_factor * cylinder.valve.nominal_flow_m3ps * opening *
                          std::sqrt((12e5 - machine.hydraulics.tank_Pa) / cylinder.valve.nominal_drop_Pa);
      const double area = command > 0 ? cylinder.rod_side_area_m2() : cylinder.head_area_m2();
      now.cylinder_m[joint] += std::copysign(flow, command) / area * 0.005;
    }
    result.samples.push_back(now);
    result.usable.push_back(1);
    result.valve.push_back(JointVector::Constant(command));
  }
  return result;
}

TEST(ValveIdentification, FindsDeadBandAndGainOfItsOwnModel) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const std::array recordings{recording(machine, 0.08, 1.2, true)};
  const ValveResult result = identify_valves(machine, recordings);
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    EXPECT_TRUE(result.axes[joint].usable) << result.axes[joint].reasons.front();
    EXPECT_NEAR(result.valves[joint].dead_band_extend, 0.08, 2e-3);
    EXPECT_NEAR(result.valves[joint].dead_band_retract, 0.08, 2e-3);
    EXPECT_NEAR(result.valves[joint].nominal_flow_m3ps / machine.cylinders[joint].valve.nominal_flow_m3ps, 1.2, 0.02);
  }
}

TEST(ValveIdentification, RefusesWhatDidNotMoveBothWays) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const std::array recordings{recording(machine, 0.08, 1, false)};
  const ValveResult result = identify_valves(machine, recordings);
  EXPECT_FALSE(result.axes[kArm].usable);
  EXPECT_NE(result.axes[kArm].reasons.front().find("arm: retracting for 0 s"), std::string::npos)
      << result.axes[kArm].reasons.front();
  EXPECT_EQ(result.valves[kArm].dead_band_extend, machine.cylinders[kArm].valve.dead_band_extend);
}

TEST(ValveIdentification, RefusesRecordingsWithoutCommandsAndCommandsThatMoveNothing) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  std::array recordings{recording(machine, 0.08, 1, true)};
  std::array silent = recordings;
  silent[0].valve.clear();
  EXPECT_NE(identify_valves(machine, silent).axes[kBoom].reasons.front().find("with valve commands"),
            std::string::npos);
  // Commands of another axis, as after a swapped plug: the speed does not follow them.
  for (std::size_t i = 0; i < recordings[0].valve.size(); ++i) {
    recordings[0].valve[i][kBoom] = 0.25 * std::cos(2 * M_PI * static_cast<double>(i) * 0.005 / 3.7);
  }
  const ValveResult swapped = identify_valves(machine, recordings);
  EXPECT_FALSE(swapped.axes[kBoom].usable);
  EXPECT_NE(swapped.axes[kBoom].reasons.front().find("misses the speed"), std::string::npos);
  EXPECT_TRUE(swapped.axes[kArm].usable);
}

}  // namespace
}  // namespace knuckle::estimation
