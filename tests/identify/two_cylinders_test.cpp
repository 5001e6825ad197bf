// Identification of a machine with pressure transmitters on two cylinders: what the others show is found, what only the
// third would show keeps the drawing's value and its doubt, and nothing is made of pressures that nobody measured.
#include "tests/support/two_cylinders.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "app/identify/data_check.h"
#include "app/identify/identify_output.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/full.h"
#include "estimation/identification/valve_identification.h"
#include "machine/load.h"
#include "tests/identify/identify_program.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::identify {
namespace {
using estimation::Recording;

MachineDescription machine_without(int joint) {
  MachineDescription machine = test::solar();
  machine.sensors.without_pressures = joint;
  return machine;
}

/// Recorded by a machine that has no such transmitters.
Recording motion_without(int joint) {
  Recording recording = recorded_motion();
  const auto k = static_cast<std::size_t>(joint);
  for (estimation::Measurement& sample : recording.samples) {
    sample.pressures_known[k] = false;
    sample.pressure_Pa[2 * k] = sample.pressure_Pa[2 * k + 1] = 0;
  }
  return recording;
}

estimation::FullResult identified(int without, const Recording& recording) {
  estimation::FullOptions options;
  options.usual_errors = false;
  options.regressor.friction.seal = false;  // so short a recording tells no seals
  return identify_full(machine_without(without), std::array{recording}, options);
}
/// From motion_without(without), once.
const estimation::FullResult& of_two(int without) {
  static std::map<int, estimation::FullResult> results;
  if (!results.contains(without)) results.emplace(without, identified(without, motion_without(without)));
  return results.at(without);
}

TEST(TwoCylinders, WhateverStandsForPressuresThatNobodyMeasuredChangesNothing) {
  for (int without = 0; without < kJoints; ++without) {
    Recording other = motion_without(without);
    for (estimation::Measurement& sample : other.samples)
      sample.pressure_Pa[static_cast<std::size_t>(2 * without)] = std::numeric_limits<double>::quiet_NaN();
    const estimation::FullResult &a = of_two(without), b = identified(without, other);
    ASSERT_TRUE(a.summary.usable) << kJointNames[static_cast<std::size_t>(without)] << a.summary.reasons.front();
    EXPECT_EQ(a.dynamics.parameters, b.dynamics.parameters);
    EXPECT_EQ(a.dynamics.covariance, b.dynamics.covariance);
  }
}

TEST(TwoCylinders, FindTheParametersThatTheyShowAsAllThreeDo) {
  const estimation::FullResult all = identified(SensorDescription::kNone, recorded_motion());
  for (int without = 0; without < kJoints; ++without) {
    const estimation::FullResult& two = of_two(without);
    const std::vector<int> unseen = estimation::unseen_columns(machine_without(without));
    EXPECT_LT(two.summary.rank, all.summary.rank);
    EXPECT_GE(two.summary.rank + static_cast<int>(unseen.size()), all.summary.rank) << "more is lost than is not seen";
    for (int k = 0; k < kBaseCount; ++k) {
      if (std::find(unseen.begin(), unseen.end(), k) != unseen.end()) continue;
      const double sigma = std::sqrt(two.dynamics.covariance(k, k) + all.dynamics.covariance(k, k));
      EXPECT_NEAR(two.dynamics.parameters[k], all.dynamics.parameters[k], 4 * sigma)
          << kJointNames[static_cast<std::size_t>(without)]
          << " missing: " << two.summary.parameters[static_cast<std::size_t>(k)].name;
    }
  }
}

TEST(TwoCylinders, KeepTheDrawingAndItsDoubtWhereOnlyTheThirdWouldShow) {
  const estimation::FullResult& found = of_two(kBoom);
  const CalibrationVector drawn = estimation::drawn_parameters(test::solar());
  for (const int k : estimation::unseen_columns(machine_without(kBoom))) {
    const estimation::IdentifiedParameter& p = found.summary.parameters[static_cast<std::size_t>(k)];
    EXPECT_TRUE(p.fixed) << p.name;
    EXPECT_EQ(p.value, std::isfinite(drawn[k]) ? drawn[k] : 0) << p.name;
    if (p.name != "boom k") {
      EXPECT_GT(p.sigma, 0.004 * std::abs(p.value)) << p.name;
    }
  }
  EXPECT_FALSE(found.summary.parameters[1].fixed);
  EXPECT_NE(found.summary.reasons.back().find("nobody measures the boom cylinder's pressures"), std::string::npos);
  const estimation::TorqueComparison torque =
      compare_torque(found.dynamics, machine_without(kBoom), motion_without(kBoom));
  const estimation::TorqueFit fit = torque_fit(torque, 2);
  EXPECT_TRUE(std::isnan(fit.rms_Nm[kBoom]));
  EXPECT_LT(fit.nrmse[kArm], 0.1);
  EXPECT_LT(fit.nrmse[kBucket], 0.1);
}

TEST(TwoCylinders, DataAreCheckedOnWhatIsMeasured) {
  const Recording good = motion_without(kBoom);
  recordings::RecordedFile file = as_file(good);
  const DataCheck check = require_data(machine_without(kBoom), file);
  EXPECT_TRUE(std::isnan(check.weight_ratio[kBoom]));
  EXPECT_NEAR(check.weight_ratio[kArm], 1, 0.5);

  Recording swapped = good;
  for (estimation::Measurement& sample : swapped.samples) std::swap(sample.pressure_Pa[2], sample.pressure_Pa[3]);
  recordings::RecordedFile bad = as_file(swapped);
  EXPECT_TRUE(test::says(test::refusal([&] { (void)require_data(machine_without(kBoom), bad); }),
                         "arm_head_Pa and arm_rod_Pa look swapped"));
}

TEST(TwoCylinders, TheValveOfTheThirdIsFittedToTheFlowAtTheArmsWeight) {
  const MachineDescription machine = machine_without(kBoom);
  const ValveDescription real = sim::sample_truth(test::solar(), 3).machine.cylinders[kBoom].valve;
  const estimation::ValveResult result = estimation::identify_valves(machine, std::array{motion_without(kBoom)});
  ASSERT_TRUE(result.axes[kBoom].usable) << result.axes[kBoom].reasons.front();
  const ValveCalibration& found = result.valves[kBoom];
  EXPECT_NEAR(found.dead_band_extend, real.dead_band_extend, 6e-3);
  EXPECT_NEAR(found.dead_band_retract, real.dead_band_retract, 6e-3);
  EXPECT_NEAR(found.nominal_flow_m3ps / real.nominal_flow_m3ps, 1, 0.15);
  EXPECT_TRUE(found.straight());
}

class TwoCylindersProgram : public test::IdentifyFolder {
 protected:
  TwoCylindersProgram() {
    for (const char* joint : {"boom", "arm"})
      std::ofstream(path(std::string("no_") + joint + ".toml")) << test::without_transmitters(joint);
  }
};

TEST_F(TwoCylindersProgram, CommissionsTheSimulatedMachineAndSaysTheSameFromItsFilesWithoutThoseColumns) {
  IdentifyOptions options;
  options.machine = path("no_boom.toml");
  options.simulate = true;
  options.slow_s = 40;
  options.fast_s = 20;
  options.record = path("rec");
  const IdentifyData driven = drive_for_data(options, [](double) {});
  const std::string table = test::content(path("rec/slow.csv"));
  EXPECT_EQ(table.find("boom_head_Pa,boom_rod_Pa,arm"), std::string("time_s,").size());
  options.recordings = {path("rec/slow.csv"), path("rec/fast.csv")};
  options.hold_out_files = {path("rec/hold_out_slow.csv"), path("rec/hold_out_digging.csv")};
  options.survey = path("rec/survey.csv");
  const IdentifyData read = read_data(options);
  EXPECT_EQ(read.sha256, driven.sha256);
  const Identified result = identify::identify(read, std::nullopt);
  ASSERT_TRUE(result.summary.usable) << result.summary.reasons.front();
  EXPECT_TRUE(result.summary.parameters[0].fixed);
  EXPECT_FALSE(result.summary.parameters[1].fixed);
  for (const HoldOut& held : result.hold_out) {
    EXPECT_NE(held.method, "kim");
    EXPECT_TRUE(std::isnan(held.to_2Hz.nrmse[kBoom])) << held.source;
    if (held.method == "full") {
      EXPECT_LT(held.to_2Hz.nrmse[kArm], 0.1) << held.source;
    }
  }
  EXPECT_TRUE(result.machine.dynamics_calibration && result.machine.geometry_calibration);
  std::ostringstream page;
  write_identify_report(read, result, page);
  EXPECT_NE(page.str().find("</html>"), std::string::npos);
}

TEST_F(TwoCylindersProgram, APapersMethodThatNeedsTheMissingPressuresIsOneLineBeforeAnythingIsDriven) {
  for (const auto& [machine, method, needs] :
       {std::tuple{"no_boom.toml", "kim", "--method kim needs the pressures of all three cylinders"},
        {"no_arm.toml", "malaguti", "--method malaguti needs the pressures of arm and bucket"},
        {"no_arm.toml", "static", "--method static needs the pressures of arm and bucket"}}) {
    const std::string said = refusal({"--simulate", "--machine", path(machine), "--method", method});
    EXPECT_TRUE(test::says(said, needs));
    EXPECT_TRUE(test::says(said, "sensors.without_pressures"));
    EXPECT_FALSE(test::says(said, "\n"));
  }
}

TEST(TwoCylinders, AreAllThatMalagutiAndZaghisMethodReads) {
  const std::array all{recorded_motion()}, two{motion_without(kBoom)};
  const auto a = estimation::identify_malaguti(test::solar(), all),
             b = estimation::identify_malaguti(machine_without(kBoom), two);
  ASSERT_EQ(b.summary.parameters.size(), 10u);
  EXPECT_TRUE(a.summary.usable && b.summary.usable);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(b.summary.parameters[i].value, a.summary.parameters[i].value);
}

}  // namespace
}  // namespace knuckle::identify
