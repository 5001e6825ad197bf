// Calibrated machine files: what is written is read again to the last digit, comments stay, no old one is lost.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <filesystem>
#include <fstream>
#include <random>

#include "app/identify/identify_output.h"
#include "core/error.h"
#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::identify {
namespace {

/// @return where the older file was kept.
std::string written(const MachineDescription& machine, const std::string& target) {
  cli::OutputFile file("--out", target);
  return write_calibrated_machine(machine, file);
}
namespace fs = std::filesystem;

const std::string kMachine = test::source_dir() + "/config/machines/solar015.toml";

/// The shipped machine with sampled calibrations.
MachineDescription identified(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  MachineDescription machine = load_machine(kMachine);
  const auto sampled = [&](double middle, double sigma) { return middle + sigma * normal(random); };
  DynamicsCalibration& dynamics = machine.dynamics_calibration.emplace();
  for (int i = 0; i < kCalibrationCount; ++i) dynamics.parameters[i] = sampled(300, 30);
  for (int j = 0; j < kJoints; ++j) dynamics.parameters[friction_index(j, kLoadShare)] = sampled(0.03, 0.005);
  for (int j = 0; j < kJoints; ++j) dynamics.parameters[friction_index(j, kSeal)] = sampled(5e-5, 1e-5);
  for (int j = 0; j < kJoints; ++j) dynamics.parameters[friction_index(j, kViscous)] = sampled(2e4, 1e3);
  const CalibrationMatrix root = CalibrationMatrix::NullaryExpr([&] { return sampled(0, 1); });
  const CalibrationVector scale = dynamics.parameters.cwiseAbs() * 0.03;
  dynamics.covariance = scale.asDiagonal() * (root * root.transpose()) * scale.asDiagonal();
  dynamics.stribeck_mps = JointVector(0.0111, 0.0122, 0.0133);
  dynamics.residual_rms_Nm = JointVector(12.3, 4.56, 1.0 / 3);
  GeometryCalibration& geometry = machine.geometry_calibration.emplace();
  for (std::size_t i = 0; i < kJoints; ++i)
    geometry.length_m[static_cast<Eigen::Index>(i)] = sampled(machine.links[i].length_m, 1e-3);
  geometry.boom_parent_pin_m = machine.boom_mount.parent_pin_m.array() + sampled(0, 1e-3);
  geometry.boom_child_pin_m = machine.boom_mount.child_pin_m.array() + sampled(0, 1e-3);
  geometry.arm_parent_pin_m = machine.arm_mount.parent_pin_m.array() + sampled(0, 1e-3);
  geometry.arm_child_pin_m = machine.arm_mount.child_pin_m.array() + sampled(0, 1e-3);
  geometry.cylinder_pin_m = machine.bucket_linkage.cylinder_pin_m.array() + sampled(0, 1e-3);
  geometry.rocker_pin_m = machine.bucket_linkage.rocker_pin_m.array() + sampled(0, 1e-3);
  geometry.bucket_pin_m = machine.bucket_linkage.bucket_pin_m.array() + sampled(0, 1e-3);
  geometry.rocker_length_m = sampled(machine.bucket_linkage.rocker_length_m, 1e-3);
  geometry.coupler_length_m = sampled(machine.bucket_linkage.coupler_length_m, 1e-3);
  geometry.encoder_offset_m = JointVector(sampled(0, 1e-3), sampled(0, 1e-3), sampled(0, 1e-3));
  geometry.tip_rms_m = std::abs(sampled(2e-3, 1e-4));
  for (std::optional<ValveCalibration>& valve : machine.valve_calibration)
    valve = ValveCalibration{sampled(0.11, 0.01), sampled(0.11, 0.01), sampled(0.02, 0.002), sampled(4e-4, 1e-5),
                             sampled(1.5, 0.2),   sampled(1, 0.1),     sampled(0.5, 0.1),    sampled(0.6, 0.1)};
  machine.calibration_provenance = {"full", "2026-11-21T05:00:00Z", std::string(64, 'a'), "a \"b\" \\c.csv", "knuckle"};
  return machine;
}

template <typename A, typename B>
void expect_same(const A& a, const B& b) {
  EXPECT_LE((a - b).cwiseAbs().maxCoeff(), 1e-12 * (1e-3 + a.cwiseAbs().maxCoeff()));
}

class CalibrationFile : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  test::TemporaryFolder folder_;
};

TEST_F(CalibrationFile, IsReadAgainToTwelveDigits) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const MachineDescription machine = identified(seed);
    (void)written(machine, path("out.toml"));
    const MachineDescription again = load_machine(path("out.toml"));
    const DynamicsCalibration &a = *machine.dynamics_calibration, &b = *again.dynamics_calibration;
    for (int i = 0; i < kCalibrationCount; ++i) EXPECT_NEAR(a.parameters[i] / b.parameters[i], 1, 1e-12);
    expect_same(a.covariance, b.covariance);
    expect_same(a.stribeck_mps, b.stribeck_mps);
    expect_same(a.residual_rms_Nm, b.residual_rms_Nm);
    const GeometryCalibration &c = *machine.geometry_calibration, &d = *again.geometry_calibration;
    expect_same(c.length_m, d.length_m);
    expect_same(c.boom_parent_pin_m, d.boom_parent_pin_m);
    expect_same(c.boom_child_pin_m, d.boom_child_pin_m);
    expect_same(c.arm_parent_pin_m, d.arm_parent_pin_m);
    expect_same(c.arm_child_pin_m, d.arm_child_pin_m);
    expect_same(c.cylinder_pin_m, d.cylinder_pin_m);
    expect_same(c.rocker_pin_m, d.rocker_pin_m);
    expect_same(c.bucket_pin_m, d.bucket_pin_m);
    expect_same(c.encoder_offset_m, d.encoder_offset_m);
    EXPECT_NEAR(c.rocker_length_m, d.rocker_length_m, 1e-12);
    EXPECT_NEAR(c.coupler_length_m, d.coupler_length_m, 1e-12);
    EXPECT_NEAR(c.tip_rms_m, d.tip_rms_m, 1e-12);
    for (std::size_t j = 0; j < kJoints; ++j) {
      const ValveCalibration &v = machine.valve_calibration[j].value(), &w = again.valve_calibration[j].value();
      EXPECT_NEAR(v.dead_band_extend, w.dead_band_extend, 1e-12);
      EXPECT_NEAR(v.dead_band_retract, w.dead_band_retract, 1e-12);
      EXPECT_NEAR(v.delay_s, w.delay_s, 1e-12);
      EXPECT_NEAR(v.nominal_flow_m3ps / w.nominal_flow_m3ps, 1, 1e-12);
      EXPECT_NEAR(v.curve_exponent, w.curve_exponent, 1e-12);
      EXPECT_NEAR(v.retract_share, w.retract_share, 1e-12);
      EXPECT_NEAR(v.notch_opening, w.notch_opening, 1e-12);
      EXPECT_NEAR(v.notch_slope, w.notch_slope, 1e-12);
    }
    EXPECT_EQ(again.calibration_provenance->data_source, "a \"b\" \\c.csv");
    EXPECT_EQ(again.calibration_provenance->date, machine.calibration_provenance->date);
  }
}

TEST_F(CalibrationFile, KeepsTheMachineFileWordForWordAndReplacesAnOlderCalibration) {
  (void)written(identified(1), path("once.toml"));
  MachineDescription again = identified(2);
  again.source = path("once.toml");
  (void)written(again, path("twice.toml"));
  const std::string original = test::content(kMachine), twice = test::content(path("twice.toml"));
  EXPECT_EQ(twice.substr(0, original.size()), original);
  again.source = kMachine;
  (void)written(again, path("fresh.toml"));
  EXPECT_EQ(twice, test::content(path("fresh.toml")));
}

TEST_F(CalibrationFile, HasNoTableOfAValveThatWasNotIdentified) {
  MachineDescription machine = identified(1);
  machine.valve_calibration[kArm].reset();
  (void)written(machine, path("out.toml"));
  const MachineDescription again = load_machine(path("out.toml"));
  EXPECT_TRUE(again.valve_calibration[kBoom] && !again.valve_calibration[kArm] && again.valve_calibration[kBucket]);
}

TEST_F(CalibrationFile, LeavesTablesThatTheUserPutBehindACalibration) {
  const std::string text = test::content(kMachine);
  const std::size_t payload = text.find("[payload]");
  const std::string moved =
      text.substr(0, payload) + "[calibration]\nmethod = \"x\"\n[calibration.valves.boom]\n" + text.substr(payload);
  EXPECT_EQ(calibrated_machine_text(moved, identified(1)), calibrated_machine_text(text, identified(1)));
}

TEST_F(CalibrationFile, KeepsEveryOlderFileUnderTheNextFreeNumber) {
  std::ofstream(path("mine.toml")) << "first";
  std::ofstream(path("mine.2.toml")) << "somebody's";
  EXPECT_EQ(written(identified(1), path("mine.toml")), fs::canonical(folder_.path()) / "mine.1.toml");
  EXPECT_EQ(written(identified(2), path("mine.toml")), fs::canonical(folder_.path()) / "mine.3.toml");
  EXPECT_EQ(test::content(path("mine.1.toml")), "first");
  EXPECT_EQ(test::content(path("mine.2.toml")), "somebody's");
  EXPECT_NE(test::content(path("mine.3.toml")), test::content(path("mine.toml")));
  EXPECT_EQ(written(identified(2), path("new.toml")), "");
}

TEST_F(CalibrationFile, IsNotTouchedByACalibrationThatWouldBeRefused) {
  std::ofstream(path("mine.toml")) << "first";
  MachineDescription machine = identified(1);
  machine.dynamics_calibration->parameters[0] = -1;
  EXPECT_THROW((void)written(machine, path("mine.toml")), InputError);
  EXPECT_EQ(test::content(path("mine.toml")), "first");
  EXPECT_EQ(folder_.count(), 1);
}

}  // namespace
}  // namespace knuckle::identify
