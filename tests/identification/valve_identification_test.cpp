// Refusals and intervals of the valve fit; what it finds is held against simulated machines in tests/commissioning.
#include "estimation/identification/valve_identification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "machine/load.h"
#include "tests/support/says.h"

namespace knuckle::estimation {
namespace {

/// A machine whose valves are exactly the model, without spool dynamics: cylinders go to and fro.
Recording recording(const MachineDescription& machine, double dead_band, double gain_factor, bool retracts,
                    double curve_exponent = 1, double retract_share = 1, double notch_opening = 0,
                    double notch_slope = 1, double amplitude = 0.25) {
  Recording result{"made up", 0.005, {}, {}, {}};
  Measurement now;
  for (int joint = 0; joint < kJoints; ++joint) now.cylinder_m[joint] = 0.95;
  now.pressure_Pa.fill(12e5);
  for (int i = 0; i < 4000; ++i) {
    // The spool's lag is short beside the ten seconds of a period; what is left of it counts as delay.
    const double wave = std::sin(2 * M_PI * i * 0.005 / 10);
    const double command = amplitude * (retracts ? wave : std::abs(wave));
    for (int joint = 0; joint < kJoints; ++joint) {
      const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
      const double opening = std::max(0.0, std::abs(command) - dead_band) / (1 - dead_band);
      const double notch_area = notch_slope * notch_opening;
      const double area_share =
          opening < notch_opening ? notch_slope * opening : 1 - (1 - notch_area) * (1 - opening) / (1 - notch_opening);
      const double share = (command > 0 ? 1 : retract_share) * std::pow(area_share, curve_exponent);
      const double flow = gain_factor * cylinder.valve.nominal_flow_m3ps * share *
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

/// As what is made up: its spools are quick.
MachineDescription without_lag() {
  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  for (CylinderDescription& cylinder : machine.cylinders) {
    cylinder.valve.natural_frequency_Hz = 40;
    cylinder.valve.hysteresis = 0;
  }
  return machine;
}

/// The others' commands are not known: only the arm is fitted, in a third of the time.
std::array<Recording, 1> of_the_arm(Recording whole) {
  for (JointVector& command : whole.valve) command[kBoom] = command[kBucket] = std::nan("");
  return {std::move(whole)};
}

// And looks for no curve where straight edges explain the speed.
TEST(ValveIdentification, FindsDeadBandAndGainOfItsOwnModel) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const std::array recordings{recording(machine, 0.08, 1.2, true)};
  const ValveResult result = identify_valves(machine, recordings);
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    EXPECT_TRUE(result.axes[joint].usable) << result.axes[joint].reasons.front();
    EXPECT_NEAR(result.valves[joint].dead_band_extend, 0.08, 2e-3);
    EXPECT_NEAR(result.valves[joint].dead_band_retract, 0.08, 2e-3);
    EXPECT_NEAR(result.valves[joint].nominal_flow_m3ps / machine.cylinders[joint].valve.nominal_flow_m3ps, 1.2, 0.02);
    EXPECT_EQ(result.axes[joint].columns, 6);
    EXPECT_EQ(result.valves[joint].curve_exponent, 1);
    EXPECT_EQ(result.valves[joint].retract_share, 1);
  }
}

TEST(ValveIdentification, FindsACurveAndAnotherFlowWhereItRetracts) {
  const MachineDescription machine = without_lag();
  for (const double exponent : {1.3, 2.2}) {
    const auto recordings = of_the_arm(recording(machine, 0.08, 4, true, exponent, 0.8));
    const ValveResult result = identify_valves(machine, recordings);
    ASSERT_TRUE(result.axes[kArm].usable) << exponent << " " << result.axes[kArm].reasons.front();
    ASSERT_EQ(result.axes[kArm].parameters.size(), 8U) << exponent;
    EXPECT_EQ(result.axes[kArm].parameters[6].name, "curve_exponent");
    EXPECT_NEAR(result.valves[kArm].curve_exponent, exponent, 0.05);
    EXPECT_NEAR(result.valves[kArm].retract_share, 0.8, 0.02);
    EXPECT_NEAR(result.valves[kArm].dead_band_extend, 0.08, 4e-3);
  }
}

/// Of a valve, its notch and how far commands go.
struct Notch {
  double exponent, opening, slope, amplitude;
};

// A curve alone fits a notch with wrong dead bands, of 0 to 0.3: the valve then counts as open where it is shut, or
// shut where it is open.
TEST(ValveIdentification, FindsTheNotchThatACurveAloneTakesForAnotherDeadBand) {
  const MachineDescription machine = without_lag();
  for (const Notch& notch : {Notch{1.2, 0.5, 0.4, 0.98}, Notch{1.4, 0.3, 0.3, 0.8}, Notch{1.3, 0.85, 0.4, 0.98}}) {
    const auto recordings =
        of_the_arm(recording(machine, 0.11, 1, true, notch.exponent, 0.9, notch.opening, notch.slope, notch.amplitude));
    const ValveResult result = identify_valves(machine, recordings);
    ASSERT_TRUE(result.axes[kArm].usable) << result.axes[kArm].reasons.front();
    EXPECT_NEAR(result.valves[kArm].dead_band_extend, 0.11, 6e-3) << notch.opening;
    EXPECT_NEAR(result.valves[kArm].dead_band_retract, 0.11, 6e-3) << notch.opening;
    EXPECT_NEAR(result.valves[kArm].curve_exponent, notch.exponent, 0.05) << notch.opening;
    EXPECT_NEAR(result.valves[kArm].notch_opening, notch.opening, 0.02) << notch.opening;
    EXPECT_NEAR(result.valves[kArm].notch_slope, notch.slope, 0.03) << notch.opening;
  }
}

TEST(ValveIdentification, LooksForNoNotchThatCommandsHardlyPass) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const auto recordings = of_the_arm(recording(machine, 0.11, 2, true, 1, 0.9, 0.3, 0.3, 0.44));
  const ValveResult result = identify_valves(machine, recordings);
  EXPECT_EQ(result.axes[kArm].columns, 8) << "a curve alone: commands end just beyond the notch";
  EXPECT_EQ(result.valves[kArm].notch_opening, 0);
}

TEST(ValveIdentification, DoesNotBelieveAFitThatHasLostTheDeadBandOfTheFile) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const auto recordings = of_the_arm(recording(machine, 0, 1, true));
  const ValveResult result = identify_valves(machine, recordings);
  EXPECT_FALSE(result.axes[kArm].usable);
  EXPECT_TRUE(test::says(result.axes[kArm].reasons.front(), "arm: the best fit has a dead band of 0"));
  EXPECT_EQ(result.valves[kArm].dead_band_extend, machine.cylinders[kArm].valve.dead_band_extend);
}

TEST(ValveIdentification, LeavesOutWhereOneAxisCommandIsUnknown) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  std::array recordings{recording(machine, 0.08, 1.2, true)};
  for (std::size_t i = 1200; i < 2200; ++i) recordings[0].valve[i][kBoom] = std::nan("");
  for (JointVector& command : recordings[0].valve) command[kBucket] = std::nan("");
  const ValveResult result = identify_valves(machine, recordings);
  EXPECT_TRUE(result.axes[kBoom].usable) << result.axes[kBoom].reasons.front();
  EXPECT_NEAR(result.valves[kBoom].dead_band_extend, 0.08, 2e-3);
  EXPECT_NEAR(result.axes[kBoom].duration_s, 15, 1e-9);
  EXPECT_NEAR(result.axes[kArm].duration_s, 20, 1e-9);
  for (JointVector& command : recordings[0].valve) command.setConstant(std::nan(""));
  EXPECT_TRUE(test::says(identify_valves(machine, recordings).axes[kBoom].reasons.front(), "with valve commands"));
}

TEST(ValveIdentification, RefusesWhatDidNotMoveBothWays) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const std::array recordings{recording(machine, 0.08, 1, false)};
  const ValveResult result = identify_valves(machine, recordings);
  EXPECT_FALSE(result.axes[kArm].usable);
  EXPECT_TRUE(test::says(result.axes[kArm].reasons.front(), "arm: retracting for 0 s"));
  EXPECT_EQ(result.valves[kArm].dead_band_extend, machine.cylinders[kArm].valve.dead_band_extend);
}

TEST(ValveIdentification, RefusesRecordingsWithoutCommandsAndCommandsThatMoveNothing) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  std::array recordings{recording(machine, 0.08, 1, true)};
  std::array silent = recordings;
  silent[0].valve.clear();
  EXPECT_TRUE(test::says(identify_valves(machine, silent).axes[kBoom].reasons.front(), "with valve commands"));
  // Commands of another axis, as after a swapped plug: the speed does not follow them.
  for (std::size_t i = 0; i < recordings[0].valve.size(); ++i) {
    recordings[0].valve[i][kBoom] = 0.25 * std::cos(2 * M_PI * static_cast<double>(i) * 0.005 / 3.7);
    recordings[0].valve[i][kBucket] = std::nan("");
  }
  const ValveResult swapped = identify_valves(machine, recordings);
  EXPECT_FALSE(swapped.axes[kBoom].usable);
  EXPECT_TRUE(test::says(swapped.axes[kBoom].reasons.front(), "misses the speed"));
  EXPECT_TRUE(swapped.axes[kArm].usable);
}

/// The arm's, of a quick spool behind a delay, so that noise is all that the model leaves; it differs only in size.
Identification arm_with_noise(double noise_m) {
  const MachineDescription machine = without_lag();
  std::array recordings{recording(machine, 0.08, 1.2, true)};
  std::rotate(recordings[0].valve.begin(), recordings[0].valve.begin() + 6, recordings[0].valve.end());
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, noise_m);
  for (Measurement& now : recordings[0].samples) now.cylinder_m[kArm] += noise(random);
  for (JointVector& command : recordings[0].valve) command[kBoom] = command[kBucket] = std::nan("");
  return identify_valves(machine, recordings).axes[kArm];
}

TEST(ValveIdentification, SigmaGrowsWithTheNoiseAndNeverBeyondWhatIsKnownOfThePressures) {
  const std::array results{arm_with_noise(1.5e-4), arm_with_noise(3e-4), arm_with_noise(6e-4)};
  const auto variance = [&](std::size_t run, std::size_t which) {
    return std::pow(results[run].parameters[which].sigma, 2);
  };
  // Variances are a s^2 + b, where b is what the model leaves out: (16 - 4) / (4 - 1) = 4.
  for (const std::size_t dead_band : {0U, 1U}) {
    EXPECT_GT(variance(2, dead_band), 1.5 * variance(0, dead_band));
    EXPECT_NEAR((variance(2, dead_band) - variance(1, dead_band)) / (variance(1, dead_band) - variance(0, dead_band)),
                4, 1.2);
  }
  // Pressures that never change tell of their offsets only the difference; the mean keeps its prior of 0.6 bar.
  for (std::size_t run = 0; run < results.size(); ++run) {
    for (const std::size_t offset : {4U, 5U}) {
      EXPECT_GT(std::sqrt(variance(run, offset)), 0.98 * 0.6e5 / std::sqrt(2)) << run;
      EXPECT_LT(std::sqrt(variance(run, offset)), 0.6e5) << run;
    }
  }
}

}  // namespace
}  // namespace knuckle::estimation
