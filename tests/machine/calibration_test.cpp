// The optional [calibration] of a machine file: what it sets, and one line for every way to break it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <sstream>

#include "machine/kinematics.h"
#include "tests/support/patterns.h"
#include "tests/support/refused_changes.h"
#include "tests/support/shipped.h"

namespace knuckle {
namespace {

/// Row-wise: 1, 2, 3 ... as variances, and one covariance of 1 between the second and the third parameter.
std::string covariance() {
  std::ostringstream text;
  for (int i = 0; i < kCalibrationCount; ++i) {
    for (int k = 0; k < kCalibrationCount; ++k) {
      text << (i == k ? i + 1 : i + k == 3 && i != 0 && k != 0 ? 1 : 0) << (k < kCalibrationCount - 1 ? ", " : ",\n");
    }
  }
  return text.str();
}

std::string calibration() {
  std::string text = R"(
[calibration]
method = "full"
date = "2026-11-21T05:00:00Z"
data_source = "a.csv"
data_sha256 = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"
program = "knuckle 0.1.0"
[calibration.dynamics]
inertia_kgm2 = [501, 102, 13]
moment_x_kgm = [304, 85, 26]
moment_z_kgm = [17, -1.8, 9]
residual_rms_Nm = [20, 10, 5]
covariance_SI = [
)" + covariance() + "]\n";
  int n = 0;
  for (const char* joint : kJointNames) {
    const int more = 100 * n++;
    text += "[calibration.dynamics.friction." + std::string(joint) +
            "]\ncoulomb_extend_N = " + std::to_string(310 + more) +
            "\ncoulomb_retract_N = " + std::to_string(290 + more) +
            "\nviscous_kNs_per_m = 21\nbreakaway_N = 90\nload_share = 0.02\nseal_N_per_bar = 3\nstribeck_mmps = 12\n";
  }
  text += R"([calibration.geometry]
length_m = [1.751, 0.949, 0.502]
boom_parent_pin_m = [0.1153, -0.2255]
boom_child_pin_m = [0.8754, 0.2374]
arm_parent_pin_m = [0.8344, 0.6294]
arm_child_pin_m = [-0.2144, 0.1349]
bucket_cylinder_pin_m = [-0.1144, 0.2733]
bucket_rocker_pin_m = [0.7515, 0]
bucket_pin_m = [-0.0120, 0.1401]
rocker_length_m = 0.2050
coupler_length_m = 0.2049
encoder_offset_mm = [1.5, -2, 0.5]
tip_rms_mm = 2.5
)";
  for (const char* joint : kJointNames) {
    text += "[calibration.valves." + std::string(joint) +
            "]\ndead_band_extend = 0.1\ndead_band_retract = 0.12\ndelay_ms = 20\nnominal_flow_Lpm = 27\n"
            "curve_exponent = 1.8\nretract_share = 0.9\nnotch_opening = 0.4\nnotch_slope = 0.7\n";
  }
  return text;
}

/// The shipped machine with this calibration.
MachineDescription loaded(const std::string& calibration_text) {
  return parse_machine(test::shipped_text() + calibration_text, "m.toml");
}
std::string calibration_refusal(const std::string& calibration_text) {
  return test::machine_refusal(test::shipped_text() + calibration_text);
}

std::string edited(const std::string& pattern, const std::string& to) {
  return test::with_match_replaced(calibration(), pattern, to);
}

TEST(MachineCalibration, SetsTheOptionalsInSiUnits) {
  const MachineDescription machine = loaded(calibration());
  ASSERT_TRUE(machine.dynamics_calibration && machine.geometry_calibration);
  ASSERT_TRUE(machine.valve_calibration[1] && machine.valve_calibration[2]);
  const DynamicsCalibration& dynamics = *machine.dynamics_calibration;
  EXPECT_EQ(dynamics.base()[0], 501);
  EXPECT_EQ(dynamics.base()[4], 85);
  EXPECT_EQ(dynamics.base()[7], -1.8);
  EXPECT_EQ(dynamics.friction(kArm).coulomb_extend_N, 410);
  EXPECT_EQ(dynamics.friction(kArm).coulomb_retract_N, 390);
  EXPECT_EQ(dynamics.friction(kBucket).viscous_Ns_per_m, 21e3);
  EXPECT_DOUBLE_EQ(dynamics.friction(kBoom).stribeck_mps, 0.012);
  EXPECT_EQ(dynamics.covariance(5, 5), 6);
  EXPECT_EQ(dynamics.covariance(1, 2), 1);
  EXPECT_EQ(machine.geometry_calibration->length_m[1], 0.949);
  EXPECT_DOUBLE_EQ(machine.geometry_calibration->encoder_offset_m[1], -0.002);
  EXPECT_DOUBLE_EQ(machine.valve_calibration[2]->delay_s, 0.020);
  EXPECT_DOUBLE_EQ(machine.valve_calibration[2]->nominal_flow_m3ps, 27e-3 / 60);
  EXPECT_EQ(machine.valve_calibration[1]->curve_exponent, 1.8);
  EXPECT_EQ(calibrated(machine).cylinders[1].valve.retract_share, 0.9);
  EXPECT_EQ(calibrated(machine).cylinders[1].valve.notch_opening, 0.4);
  EXPECT_EQ(calibrated(machine).cylinders[1].valve.notch_slope, 0.7);
  EXPECT_EQ(machine.calibration_provenance->method, "full");
  EXPECT_EQ(machine.links[1].length_m, 0.95) << "the drawing stays until calibrated() is asked";
  EXPECT_EQ(calibrated(machine).links[1].length_m, 0.949);
}

TEST(MachineCalibration, EachPartIsOptionalButNotWhereItCameFrom) {
  const std::string text = calibration();
  const auto from = [&](const char* table) { return text.find(table); };
  EXPECT_FALSE(loaded("").calibration_provenance);
  const MachineDescription none = loaded(text.substr(0, from("[calibration.dynamics]")));
  EXPECT_TRUE(none.calibration_provenance && !none.dynamics_calibration && !none.valve_calibration[0]);
  EXPECT_TRUE(
      test::says(calibration_refusal(text.substr(from("[calibration.geometry]"))), "'calibration.method' is missing"));
}

TEST(MachineCalibration, AnAxisWhoseValveWasNotIdentifiedKeepsTheDrawings) {
  const std::string text = calibration();
  const std::size_t arm = text.find("[calibration.valves.arm]");
  const MachineDescription machine =
      loaded(text.substr(0, arm) + text.substr(text.find("[calibration.valves.bucket]")));
  EXPECT_TRUE(machine.valve_calibration[kBoom] && machine.valve_calibration[kBucket]);
  EXPECT_FALSE(machine.valve_calibration[kArm]);
  const MachineDescription found = calibrated(machine);
  EXPECT_EQ(found.cylinders[kBoom].valve.curve_exponent, 1.8);
  EXPECT_EQ(found.cylinders[kArm].valve.curve_exponent, 1);
  EXPECT_EQ(found.cylinders[kArm].valve.dead_band_extend, machine.cylinders[kArm].valve.dead_band_extend);
  EXPECT_TRUE(test::says(calibration_refusal(text.substr(0, arm) + "[calibration.valves.stick]\n"),
                         "calibration.valves.stick"));
}

TEST(MachineCalibration, RefusesEveryMissingAndEveryUnknownKeyByName) {
  std::istringstream lines(calibration());
  std::string line, table;
  int keys = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with("[")) table = line.substr(1, line.find(']') - 1);
    const std::size_t equals = line.find(" = ");
    if (equals == std::string::npos || line.starts_with("covariance")) continue;
    std::string text = calibration();
    const std::size_t at = text.find(line, text.find("[" + table + "]"));
    const std::string key = line.substr(0, equals);
    EXPECT_TRUE(
        test::says(calibration_refusal(text.erase(at, line.size())), "key '" + table + "." + key + "' is missing"))
        << key;
    EXPECT_TRUE(test::says(calibration_refusal(text.insert(at, "x" + line)), "key '" + table)) << key;
    ++keys;
  }
  EXPECT_EQ(keys, 5 + 4 + 21 + 12 + 24);
}

TEST(MachineCalibration, AFileFromBeforeNotchesWereLookedForHasNone) {
  std::string text = calibration();
  for (const std::string key : {"notch_opening = 0.4\n", "notch_slope = 0.7\n"})
    for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key)) text.erase(at, key.size());
  const ValveDescription valve = calibrated(loaded(text)).cylinders[kArm].valve;
  EXPECT_EQ(valve.curve_exponent, 1.8);
  EXPECT_EQ(valve.notch_opening, 0);
  EXPECT_EQ(valve.notch_slope, 1);
}

TEST(MachineCalibration, RefusesWhatNoMachineCanHave) {
  const std::vector<std::array<std::string, 3>> cases{
      {"501", "-501", "calibration.dynamics.inertia_kgm2"},
      {"501", "nan", "calibration.dynamics.inertia_kgm2"},
      {"coulomb_retract_N = 290", "coulomb_retract_N = -311", "coulomb_retract_N' = -311: must be at least -310"},
      {"breakaway_N = 90", "breakaway_N = -301", "breakaway_N' = -301: must be at least -300"},
      {"viscous_kNs_per_m = 21", "viscous_kNs_per_m = -1", "viscous_kNs_per_m' = -1: must be within [0, 2000]"},
      {"1, 0, 0", "-1, 0, 0", "covariance_SI': must have no negative number on its diagonal"},
      {"1, 0, 0", "1, 0.5, 0", "covariance_SI': must be symmetric"},
      {"1, 0, 0", "0, 0.5, 0", "covariance_SI': must be 0 beside a parameter whose variance is 0"},
      {"27,", "27, 1,", "covariance_SI': must be 729 numbers"},
      {"tip_rms_mm = 2.5", "tip_rms_mm = -1", "calibration.geometry.tip_rms_mm"},
      {"encoder_offset_mm = .1.5", "encoder_offset_mm = [900", "calibration.geometry.encoder_offset_mm"},
      {"rocker_length_m = 0.2050", "rocker_length_m = 0.1050", "in place of the drawing's: '"},
      {"dead_band_extend = 0.1", "dead_band_extend = 0.5", "calibration.valves.boom.dead_band_extend"},
      {"seal_N_per_bar = 3", "seal_N_per_bar = 1001", "boom.seal_N_per_bar' = 1001: must be within [0, 1000]"},
      {"seal_N_per_bar = 3", "seal_N_per_bar = -3", "boom.seal_N_per_bar' = -3: must be within [0, 1000]"},
      {"load_share = 0.02", "load_share = -0.01", "boom.load_share' = -0.01: must be within [0, 0.5]"},
      {"curve_exponent = 1.8", "curve_exponent = 0", "calibration.valves.boom.curve_exponent' = 0: must be within"},
      {"retract_share = 0.9", "retract_share = -1", "calibration.valves.boom.retract_share' = -1: must be within"},
      {"notch_opening = 0.4", "notch_opening = 1", "calibration.valves.boom.notch_opening' = 1: must be within"},
      {"notch_slope = 0.7", "notch_slope = 0", "calibration.valves.boom.notch_slope' = 0: must be within"},
      {"0123456789abcdef", "0123456789abcdeF", "calibration.data_sha256"},
  };
  for (const auto& [pattern, to, named] : cases) {
    const std::string line = calibration_refusal(edited(pattern, to));
    const std::size_t end = named.find("':");  // of the key, the bound behind it
    EXPECT_TRUE(test::says(line, named.substr(0, end))) << named;
    const std::string bound = end == std::string::npos ? "" : named.substr(end + 2);
    EXPECT_TRUE(test::says(line, bound)) << named;
    EXPECT_FALSE(test::says(line, "\n"));
  }
}

TEST(MachineCalibration, RefusesACovarianceThatIsNotPositiveSemidefinite) {
  std::string text = edited("0, 2, 1, 0", "0, 2, 3, 0");  // correlation 3 / sqrt(2 * 3)
  const std::size_t at = text.find("0, 1, 3, 0");
  ASSERT_NE(at, std::string::npos);
  EXPECT_TRUE(test::says(calibration_refusal(text.replace(at, 10, "0, 3, 3, 0")), "must be positive semidefinite"));
}

}  // namespace
}  // namespace knuckle
