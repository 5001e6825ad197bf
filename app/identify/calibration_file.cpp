#include <fmt/format.h>

#include <array>
#include <charconv>
#include <sstream>

#include "app/identify/identify_output.h"
#include "core/error.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/toml_reader.h"

namespace knuckle::identify {
namespace {

constexpr const char* kOpening = "# Written by knuckle identify; what stands above is the machine's drawing.";

/// Shortest digits that give the same number again.
std::string shortest_digits(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return with_point({text.data(), end});
}

/// For comments.
std::string rounded(double value) {
  return fmt::format("{:.2g}", value);
}

template <typename Vector>
std::string array(const Vector& values, double unit = 1) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < values.size(); ++i) text += (i > 0 ? ", " : "") + shortest_digits(values[i] / unit);
  return text + "]";
}

void write_provenance(std::ostream& out, const CalibrationProvenance& from) {
  out << "[calibration]\nmethod = " << toml_quoted(from.method) << "\ndate = " << toml_quoted(from.date)
      << "\ndata_source = " << toml_quoted(from.data_source) << "\ndata_sha256 = " << toml_quoted(from.data_sha256)
      << "\nprogram = " << toml_quoted(from.program) << '\n';
}

void write_dynamics(std::ostream& out, const DynamicsCalibration& dynamics) {
  const CalibrationVector sigma = dynamics.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const auto three = [&](const char* key, int first) {
    out << key << " = " << array(dynamics.parameters.segment<kJoints>(first)) << "  # sigma " << rounded(sigma[first])
        << ", " << rounded(sigma[first + 1]) << ", " << rounded(sigma[first + 2]) << '\n';
  };
  out << "\n[calibration.dynamics]         # base parameters: boom, arm, bucket; later links' masses included\n";
  three("inertia_kgm2", 0);
  three("moment_x_kgm", kJoints);
  three("moment_z_kgm", 2 * kJoints);
  out << "residual_rms_Nm = " << array(dynamics.residual_rms_Nm)
      << "  # joint torque left over on held-out motion, to 2 Hz\n";
  out << "# sigma and covariance_SI are of the torques that this machine's own sensors make of the parameters.\n"
         "# Of the parameters in this order: three of each line above, then of each cylinder coulomb_extend_N,\n"
         "# coulomb_retract_N, viscous_Ns_per_m (SI, not kNs), breakaway_N, load_share, seal_m2 (SI, not N/bar).\n"
         "covariance_SI = [\n";
  for (int i = 0; i < kCalibrationCount; ++i) {
    const std::string row = array(dynamics.covariance.row(i));
    out << "  " << row.substr(1, row.size() - 2) << ",\n";
  }
  out << "]\n";
  for (int joint = 0; joint < kJoints; ++joint) {
    const FrictionCalibration friction = dynamics.friction(joint);
    const auto line = [&](const char* key, double value, double unit, FrictionIndex which) {
      out << key << " = " << shortest_digits(value / unit) << "  # sigma "
          << rounded(sigma[friction_index(joint, which)] / unit) << '\n';
    };
    out << "[calibration.dynamics.friction." << kJointNames[static_cast<std::size_t>(joint)] << "]\n";
    line("coulomb_extend_N", friction.coulomb_extend_N, 1, kCoulombExtend);
    line("coulomb_retract_N", friction.coulomb_retract_N, 1, kCoulombRetract);
    line("viscous_kNs_per_m", friction.viscous_Ns_per_m, 1e3, kViscous);
    line("breakaway_N", friction.breakaway_N, 1, kBreakaway);
    line("load_share", friction.load_share, 1, kLoadShare);
    line("seal_N_per_bar", friction.seal_m2, 1e-5, kSeal);
    out << "stribeck_mmps = " << shortest_digits(friction.stribeck_mps / kMilli) << '\n';
  }
}

void write_geometry(std::ostream& out, const GeometryCalibration& geometry) {
  out << "\n[calibration.geometry]         # in place of links, mounts and linkage above\n"
      << "length_m = " << array(geometry.length_m) << "\nboom_parent_pin_m = " << array(geometry.boom_parent_pin_m)
      << "\nboom_child_pin_m = " << array(geometry.boom_child_pin_m)
      << "\narm_parent_pin_m = " << array(geometry.arm_parent_pin_m)
      << "\narm_child_pin_m = " << array(geometry.arm_child_pin_m)
      << "\nbucket_cylinder_pin_m = " << array(geometry.cylinder_pin_m)
      << "\nbucket_rocker_pin_m = " << array(geometry.rocker_pin_m)
      << "\nbucket_pin_m = " << array(geometry.bucket_pin_m)
      << "\nrocker_length_m = " << shortest_digits(geometry.rocker_length_m)
      << "\ncoupler_length_m = " << shortest_digits(geometry.coupler_length_m)
      << "\nencoder_offset_mm = " << array(geometry.encoder_offset_m, kMilli) << "  # reading minus true length\n"
      << "tip_rms_mm = " << shortest_digits(geometry.tip_rms_m / kMilli) << "  # of held-out poses\n";
}

void write_valves(std::ostream& out, const PerJoint<std::optional<ValveCalibration>>& valves) {
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    if (!valves[joint]) continue;
    const ValveCalibration& valve = *valves[joint];
    out << "\n[calibration.valves." << kJointNames[joint]
        << "]\ndead_band_extend = " << shortest_digits(valve.dead_band_extend)
        << "\ndead_band_retract = " << shortest_digits(valve.dead_band_retract)
        << "\ndelay_ms = " << shortest_digits(valve.delay_s / kMilli)
        << "\nnominal_flow_Lpm = " << shortest_digits(valve.nominal_flow_m3ps / kLitrePerMinute)
        << "\ncurve_exponent = " << shortest_digits(valve.curve_exponent)
        << "\nretract_share = " << shortest_digits(valve.retract_share)
        << "\nnotch_opening = " << shortest_digits(valve.notch_opening)
        << "\nnotch_slope = " << shortest_digits(valve.notch_slope) << '\n';
  }
}

}  // namespace

std::string calibrated_machine_text(std::string_view machine_file, const MachineDescription& machine) {
  std::ostringstream out;
  out << without_toml_record(machine_file, "calibration", kOpening) << '\n' << kOpening << '\n';
  write_provenance(out, machine.calibration_provenance.value());
  if (machine.dynamics_calibration) write_dynamics(out, *machine.dynamics_calibration);
  if (machine.geometry_calibration) write_geometry(out, *machine.geometry_calibration);
  write_valves(out, machine.valve_calibration);
  (void)parse_machine(out.str(), "calibrated " + machine.source);
  return out.str();
}

std::string write_calibrated_machine(const MachineDescription& machine, cli::OutputFile& file) {
  file.stream() << calibrated_machine_text(whole_file(machine.source, kLargestToml_MB), machine);
  return file.commit_keeping_older();
}

}  // namespace knuckle::identify
