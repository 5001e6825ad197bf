// Identification of a machine with pressure transmitters on two cylinders: what the others show is found, what only the
// third would show keeps the drawing's value and its doubt, and nothing is made of pressures that nobody measured.
#include "tests/support/two_cylinders.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/identify/data_check.h"
#include "estimation/identification/full.h"
#include "estimation/identification/valve_identification.h"
#include "machine/load.h"
#include "tests/identify/identify_program.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/refusal.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::identify {
namespace {
using estimation::Recording;
using test::ProgramRun;

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

TEST(TwoCylinders, WhateverStandsForPressuresThatNobodyMeasuredChangesNothing) {
  for (int without = 0; without < kJoints; ++without) {
    Recording other = motion_without(without);
    for (estimation::Measurement& sample : other.samples)
      sample.pressure_Pa[static_cast<std::size_t>(2 * without)] = std::numeric_limits<double>::quiet_NaN();
    const estimation::FullResult a = identified(without, motion_without(without)), b = identified(without, other);
    ASSERT_TRUE(a.summary.usable) << kJointNames[static_cast<std::size_t>(without)] << a.summary.reasons.front();
    EXPECT_EQ(a.dynamics.parameters, b.dynamics.parameters);
    EXPECT_EQ(a.dynamics.covariance, b.dynamics.covariance);
  }
}

TEST(TwoCylinders, FindTheParametersThatTheyShowAsAllThreeDo) {
  const estimation::FullResult all = identified(SensorDescription::kNone, recorded_motion());
  for (int without = 0; without < kJoints; ++without) {
    const estimation::FullResult two = identified(without, motion_without(without));
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
  const estimation::FullResult found = identified(kBoom, motion_without(kBoom));
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
  EXPECT_NE(test::refusal([&] {
              (void)require_data(machine_without(kBoom), bad);
            }).find("arm_head_Pa and arm_rod_Pa look swapped"),
            std::string::npos);
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
  const ProgramRun driven =
      identify({"--simulate", "--machine", path("no_boom.toml"), "--slow", "40", "--fast", "20", "--record",
                path("rec"), "--out", path("cal.toml"), "--json", path("driven.json"), "--report", path("page.html")});
  ASSERT_EQ(driven.exit_code, 0) << driven.out << driven.err;
  std::string table = test::content(path("rec/slow.csv"));
  EXPECT_EQ(table.find("boom_head_Pa,boom_rod_Pa,arm"), std::string("time_s,").size());
  const ProgramRun read =
      identify({path("rec/slow.csv"), path("rec/fast.csv"), "--hold-out", path("rec/hold_out_slow.csv"), "--hold-out",
                path("rec/hold_out_digging.csv"), "--survey", path("rec/survey.csv"), "--machine", path("no_boom.toml"),
                "--json", path("read.json")});
  ASSERT_EQ(read.exit_code, 0) << read.out << read.err;
  const nlohmann::json a = json("driven.json"), b = json("read.json");
  EXPECT_EQ(a["parameters"], b["parameters"]);
  EXPECT_EQ(a["parameters"][0]["fixed"], true);
  EXPECT_EQ(a["parameters"][1]["fixed"], false);
  for (const auto& held : a["hold_out"]) {
    EXPECT_NE(held["method"], "kim");
    EXPECT_TRUE(held["to_2Hz"]["nrmse"]["boom"].is_null()) << held;
    if (held["method"] == "full") {
      EXPECT_LT(held["to_2Hz"]["nrmse"]["arm"], 0.1) << held;
    }
  }
  const MachineDescription machine = load_machine(path("cal.toml"));
  ASSERT_TRUE(machine.dynamics_calibration && machine.geometry_calibration);
  EXPECT_EQ(machine.sensors.without_pressures, kBoom);
}

TEST_F(TwoCylindersProgram, APapersMethodThatNeedsTheMissingPressuresIsOneLineBeforeAnythingIsDriven) {
  for (const auto& [machine, method, needs] :
       {std::tuple{"no_boom.toml", "kim", "--method kim needs the pressures of all three cylinders"},
        {"no_arm.toml", "malaguti", "--method malaguti needs the pressures of arm and bucket"},
        {"no_arm.toml", "static", "--method static needs the pressures of arm and bucket"}}) {
    const ProgramRun run = identify({"--simulate", "--machine", path(machine), "--method", method});
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find(needs), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("sensors.without_pressures"), std::string::npos) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
}

TEST_F(TwoCylindersProgram, MalagutiAndZaghisMethodIsTheirMachine) {
  const ProgramRun run =
      identify({"--simulate", "--machine", path("no_boom.toml"), "--method", "malaguti", "--json", path("a.json")});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_EQ(json("a.json")["parameters"].size(), 10u);
}

}  // namespace
}  // namespace knuckle::identify
