#include "machine/load_calibration.h"

#include <Eigen/Core>
#include <algorithm>

#include "core/symmetric_eigen.h"
#include "core/units.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle {
namespace {

constexpr double kFurthestOffset_mm = 500;
constexpr double kLargestInertia_kgm2 = 1e8, kLargestMoment_kgm = 1e6;
constexpr double kStrongestFriction_N = 1e5;
constexpr double kRounding = 1e-9;  // of a correlation, by the digits of a file

CalibrationProvenance read_provenance(TomlTable& file) {
  CalibrationProvenance provenance;
  provenance.method = file.text("method");
  provenance.date = file.text("date");
  provenance.data_sha256 = file.text("data_sha256");
  const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  file.require(provenance.data_sha256.size() == 64 &&
                   std::all_of(provenance.data_sha256.begin(), provenance.data_sha256.end(), is_hex),
               "data_sha256", "must be 64 digits 0-9 and a-f");
  provenance.data_source = file.text("data_source");
  provenance.program = file.text("program");
  return provenance;
}

/// A file keeps its digits, so that a matrix made symmetric stays so.
void check_covariance(const TomlTable& file, const CalibrationMatrix& covariance) {
  const CalibrationVector variance = covariance.diagonal();
  if (!file.require((variance.array() >= 0).all(), "covariance_SI", "must have no negative number on its diagonal"))
    return;
  const CalibrationVector sigma = variance.cwiseSqrt();
  CalibrationMatrix correlation = CalibrationMatrix::Zero();
  for (int i = 0; i < kCalibrationCount; ++i) {
    for (int k = 0; k < kCalibrationCount; ++k) {
      const double scale = sigma[i] * sigma[k];
      if (!file.require(scale > 0 || covariance(i, k) == 0, "covariance_SI",
                        "must be 0 beside a parameter whose variance is 0"))
        return;
      if (scale > 0) correlation(i, k) = covariance(i, k) / scale;
    }
  }
  file.require((correlation - correlation.transpose()).cwiseAbs().maxCoeff() <= kRounding, "covariance_SI",
               "must be symmetric");
  const double least = symmetric_eigen(correlation).values[0];
  file.require(least >= -kRounding, "covariance_SI",
               "must be positive semidefinite; its least eigenvalue, as correlations, is " + number_text(least));
}

/// A pressure transmitter that reads wrong by a constant raises one direction's Coulomb force and lowers the other's,
/// even below zero: only their mean is friction, and that never drives.
void read_friction(TomlTable file, int joint, DynamicsCalibration& dynamics) {
  const auto set = [&](FrictionIndex which, double value) {
    dynamics.parameters[friction_index(joint, which)] = value;
  };
  const double extend_N = file.number("coulomb_extend_N", -kStrongestFriction_N, kStrongestFriction_N);
  const double retract_N = file.number("coulomb_retract_N", -kStrongestFriction_N, kStrongestFriction_N);
  file.require(extend_N + retract_N >= 0, "coulomb_retract_N",
               "must be at least " + number_text(-extend_N) +
                   ", or friction drives: its sum with coulomb_extend_N is "
                   "twice the Coulomb force",
               {"coulomb_extend_N"});
  const double breakaway_N = file.number("breakaway_N", -kStrongestFriction_N, kStrongestFriction_N);
  file.require(2 * breakaway_N >= -extend_N - retract_N, "breakaway_N",
               "must be at least " + number_text(-(extend_N + retract_N) / 2) + ", or static friction drives",
               {"coulomb_extend_N", "coulomb_retract_N"});
  set(kCoulombExtend, extend_N);
  set(kCoulombRetract, retract_N);
  set(kBreakaway, breakaway_N);
  set(kViscous, file.number("viscous_kNs_per_m", 0, 2000, 1e3));
  set(kLoadShare, file.number("load_share", 0, 0.5));
  set(kSeal, file.number("seal_N_per_bar", 0, 1000, 1e-5));
  dynamics.stribeck_mps[joint] = file.number("stribeck_mmps", 0.1, 500, kMilli);
}

DynamicsCalibration read_dynamics(TomlTable file) {
  DynamicsCalibration dynamics;
  dynamics.parameters.segment<kJoints>(0) = file.numbers<kJoints>("inertia_kgm2", 1e-4, kLargestInertia_kgm2);
  dynamics.parameters.segment<kJoints>(kJoints) =
      file.numbers<kJoints>("moment_x_kgm", -kLargestMoment_kgm, kLargestMoment_kgm);
  dynamics.parameters.segment<kJoints>(2 * kJoints) =
      file.numbers<kJoints>("moment_z_kgm", -kLargestMoment_kgm, kLargestMoment_kgm);
  TomlTable friction = file.table("friction");
  for (int joint = 0; joint < kJoints; ++joint)
    read_friction(friction.table(kJointNames[static_cast<std::size_t>(joint)]), joint, dynamics);
  dynamics.residual_rms_Nm = file.numbers<kJoints>("residual_rms_Nm", 0, 1e6);
  constexpr std::size_t kCount = kCalibrationCount * kCalibrationCount;
  constexpr double kLargest = 1e18;  // (1e9 in SI units)^2
  const std::vector<double> rows = file.list("covariance_SI", kCount, kCount, -kLargest, kLargest);
  using RowMajor = Eigen::Matrix<double, kCalibrationCount, kCalibrationCount, Eigen::RowMajor>;
  dynamics.covariance = Eigen::Map<const RowMajor>(rows.data());
  check_covariance(file, dynamics.covariance);
  return dynamics;
}

GeometryCalibration read_geometry(TomlTable file) {
  GeometryCalibration geometry;
  geometry.length_m = file.numbers<kJoints>("length_m", 0.05, kFurthestPin_m);
  geometry.boom_parent_pin_m = read_pin(file, "boom_parent_pin_m");
  geometry.boom_child_pin_m = read_pin(file, "boom_child_pin_m");
  geometry.arm_parent_pin_m = read_pin(file, "arm_parent_pin_m");
  geometry.arm_child_pin_m = read_pin(file, "arm_child_pin_m");
  geometry.cylinder_pin_m = read_pin(file, "bucket_cylinder_pin_m");
  geometry.rocker_pin_m = read_pin(file, "bucket_rocker_pin_m");
  geometry.bucket_pin_m = read_pin(file, "bucket_pin_m");
  geometry.rocker_length_m = file.number("rocker_length_m", 0.01, kFurthestPin_m);
  geometry.coupler_length_m = file.number("coupler_length_m", 0.01, kFurthestPin_m);
  geometry.encoder_offset_m =
      file.numbers<kJoints>("encoder_offset_mm", -kFurthestOffset_mm, kFurthestOffset_mm, kMilli);
  geometry.tip_rms_m = file.number("tip_rms_mm", 0, 1e3, kMilli);
  return geometry;
}

ValveCalibration read_valve(TomlTable file) {
  ValveCalibration valve{.dead_band_extend = file.number("dead_band_extend", 0, 0.4),
                         .dead_band_retract = file.number("dead_band_retract", 0, 0.4),
                         .delay_s = file.number("delay_ms", 0, 500, kMilli),
                         .nominal_flow_m3ps = file.number("nominal_flow_Lpm", 1, 2000, kLitrePerMinute),
                         .curve_exponent = file.number("curve_exponent", 0.5, 4),
                         .retract_share = file.number("retract_share", 0.1, 10)};
  if (file.has("notch_opening") || file.has("notch_slope")) {  // files from before notches were looked for have none
    valve.notch_opening = file.number("notch_opening", 0, 0.95);
    valve.notch_slope = file.number("notch_slope", 0.05, 1);
  }
  return valve;
}

/// The calibrated geometry with the working ranges and strokes of the drawing, where all of that is known.
void check_with_drawing(const TomlTable& calibration, const MachineDescription& machine) {
  if (!calibration.sound({"geometry", ".links", ".cylinders", ".mounts"})) return;
  std::string all;
  try {
    (void)Kinematics(calibrated(machine));
  } catch (const GeometryErrors& found) {
    for (const GeometryError& error : found.errors())
      all += (all.empty() ? "'" : "; '") + key_of(error) + "' = " + number_text(error.value) + " " + error.bound;
  }
  calibration.require(all.empty(), "geometry", "in place of the drawing's: " + all);
}

}  // namespace

void load_calibration(TomlTable& file, MachineDescription& machine) {
  if (!file.has("calibration")) return;
  TomlTable calibration = file.table("calibration");
  machine.calibration_provenance = read_provenance(calibration);
  if (calibration.has("dynamics")) machine.dynamics_calibration = read_dynamics(calibration.table("dynamics"));
  if (calibration.has("geometry")) machine.geometry_calibration = read_geometry(calibration.table("geometry"));
  if (calibration.has("valves")) {
    TomlTable valves = calibration.table("valves");
    for (std::size_t joint = 0; joint < kJoints; ++joint) {
      if (valves.has(kJointNames[joint]))
        machine.valve_calibration[joint] = read_valve(valves.table(kJointNames[joint]));
    }
  }
  if (machine.geometry_calibration) check_with_drawing(calibration, machine);
}

}  // namespace knuckle
