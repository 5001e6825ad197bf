#include "app/session/truth_file.h"

#include "app/cli/command.h"
#include "core/units.h"
#include "machine/toml_reader.h"

namespace knuckle::session {
namespace {

/// Every key may be absent: the value stays as it is.
void read(TomlTable& table, const char* key, double min, double max, double factor, double& value) {
  if (table.has(key)) value = table.number(key, min, max, factor);
}

void read_friction(TomlTable table, sim::LuGreFriction& friction) {
  read(table, "coulomb_extend_N", 1, 1e5, 1, friction.coulomb_extend_N);
  read(table, "coulomb_retract_N", 1, 1e5, 1, friction.coulomb_retract_N);
  read(table, "static_ratio", 1, 4, 1, friction.static_ratio);
  read(table, "stribeck_mmps", 1, 100, 1e-3, friction.stribeck_mps);
  read(table, "viscous_kNs_per_m", 0, 1000, 1e3, friction.viscous_Ns_per_m);
  read(table, "seal_N_per_bar", 0, 100, 1e-5, friction.seal_N_per_Pa);
  read(table, "pin_share", 0, 0.3, 1, friction.pin_share);
}

void read_valve(TomlTable table, ValveDescription& valve, sim::ValveRoughness& rough) {
  read(table, "dead_band_extend", 0, 0.5, 1, valve.dead_band_extend);
  read(table, "dead_band_retract", 0, 0.5, 1, valve.dead_band_retract);
  read(table, "hysteresis", 0, 0.1, 1, valve.hysteresis);
  read(table, "delay_ms", 0, 100, 1e-3, valve.delay_s);
  read(table, "natural_frequency_Hz", 1, 50, 1, valve.natural_frequency_Hz);
  read(table, "curve_exponent", 0.5, 3, 1, rough.curve_exponent);
  read(table, "notch_opening", 0, 0.9, 1, rough.notch_opening);
  read(table, "notch_slope", 0.05, 1, 1, rough.notch_slope);
  read(table, "retract_gain", 0.3, 3, 1, rough.retract_gain);
  read(table, "stiction", 0, 0.1, 1, rough.stiction);
  read(table, "null_drift_per_K", -0.002, 0.002, 1, rough.null_drift_per_K);
  read(table, "leakage_Lpm_per_100bar", 0, 5, 1e-3 / 60 / 1e7, rough.leakage_m3ps_per_Pa);
}

/// Mass, track and ground; the rest is as hulls of this size usually have it.
sim::HullTruth read_hull(TomlTable table, const MachineDescription& nominal) {
  const double mass_kg = table.number("mass_kg", 100, 1e5), track_m = table.number("track_m", 0.3, 10);
  const double stiffness = table.number("ground_stiffness_kN_per_mm", 0.05, 1000, 1e6);
  sim::HullTruth hull = sim::hull_on_tracks(nominal, mass_kg, track_m, stiffness, table.number("damping_ratio", 0, 1));
  read(table, "settling_mm_per_kN", 0, 100, 1e-6, hull.settling_m_per_N);
  read(table, "bearing_ratio", 1, 10, 1, hull.bearing_ratio);
  return hull;
}

/// Tight, rigid pins where there is no table.
sim::PinTruth read_pins(TomlTable table, const CylinderDescription& cylinder) {
  const double stiffness = table.number("stiffness_kN_per_mm", 1, 100, 1e6);
  double play_m = 0;
  read(table, "play_mm", 0, 5, 1e-3, play_m);
  return sim::compliant_pin(stiffness, play_m, cylinder.body_mass_kg + cylinder.rod_mass_kg);
}

void read_joint(TomlTable table, std::size_t joint, sim::MachineTruth& truth) {
  double mass_factor = 1;
  read(table, "mass_factor", 0.5, 2, 1, mass_factor);
  truth.machine.links[joint].mass_kg *= mass_factor;
  truth.machine.links[joint].inertia_kgm2 *= mass_factor;
  if (table.has("friction")) read_friction(table.table("friction"), truth.friction[joint]);
  if (table.has("pins")) truth.pin[joint] = read_pins(table.table("pins"), truth.machine.cylinders[joint]);
  if (table.has("valve")) read_valve(table.table("valve"), truth.machine.cylinders[joint].valve, truth.valve[joint]);
}

}  // namespace

sim::MachineTruth load_truth(const std::string& path, const MachineDescription& nominal) {
  sim::MachineTruth truth = sim::nominal_truth(nominal);
  TomlTable file = TomlTable::read_kind("truth", path);
  if (file.has("pressure_offset_bar")) {
    const auto offset_Pa = file.numbers<6>("pressure_offset_bar", -20, 20, 1e5);
    for (std::size_t i = 0; i < 6; ++i) truth.pressure[i].offset_Pa = offset_Pa[static_cast<Eigen::Index>(i)];
  }
  double lag_s = 0;
  read(file, "pressure_lag_ms", 0, 50, 1e-3, lag_s);
  for (sim::PressureSensorError& sensor : truth.pressure) sensor.lag_s = lag_s;
  if (file.has("encoder_offset_mm")) truth.encoder_offset_m = file.numbers<3>("encoder_offset_mm", -5, 5, 1e-3);
  if (file.has("pressure_drift_bar_per_10K")) {
    const auto drift = file.numbers<6>("pressure_drift_bar_per_10K", -5, 5, 1e4);
    for (std::size_t i = 0; i < 6; ++i) truth.pressure[i].drift_Pa_per_K = drift[static_cast<Eigen::Index>(i)];
  }
  if (file.has("encoder_scale")) truth.encoder_scale = file.numbers<3>("encoder_scale", -0.05, 0.05);
  if (file.has("encoder_slack_mm")) truth.encoder_slack_m = file.numbers<3>("encoder_slack_mm", 0, 10, 1e-3);
  read(file, "encoder_noise_mm", 0, 1, 1e-3, truth.encoder_noise_m);
  read(file, "hull_pitch_deg", -30, 30, kDegree, truth.hull_pitch_rad);
  read(file, "tilt_offset_deg", -5, 5, kDegree, truth.tilt_offset_rad);
  read(file, "warm_up_K", -60, 60, 1, truth.warm_up.rise_K);
  read(file, "warm_up_s", 1, 1e5, 1, truth.warm_up.time_s);
  read(file, "pump_ripple_bar", 0, 20, 1e5, truth.pump.ripple_Pa);
  read(file, "pump_ripple_Hz", 20, 1000, 1, truth.pump.ripple_Hz);
  read(file, "regulator_Hz", 0.5, 20, 1, truth.pump.regulator_Hz);
  read(file, "regulator_damping_ratio", 0.05, 2, 1, truth.pump.regulator_damping);
  read(file, "cross_talk", 0, 0.3, 1, truth.cross_talk);
  read(file, "viscosity_factor", 0.2, 5, 1, truth.viscosity_factor);
  read(file, "bulk_modulus_GPa", 0.2, 3, 1e9, truth.machine.hydraulics.bulk_modulus_Pa);
  if (file.has("hull")) truth.hull = read_hull(file.table("hull"), nominal);
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (file.has(kJointNames[i])) read_joint(file.table(kJointNames[i]), i, truth);
  }
  file.finish();
  sim::check_truth(truth);
  return truth;
}

sim::Family family_named(const std::string& name) {
  if (name.empty()) return sim::Family::kSmooth;
  for (const auto family : {sim::Family::kSmooth, sim::Family::kServiced, sim::Family::kWorn}) {
    if (name == sim::name(family)) return family;
  }
  cli::refuse_option("--family", name, "must be one of smooth, serviced, worn");
}

sim::MachineTruth truth_for(const MachineDescription& nominal, const std::string& file, const std::string& family,
                            std::uint64_t seed) {
  if (file.empty()) return sim::sample_truth(nominal, family_named(family), seed);
  if (!family.empty()) cli::refuse_option("--family", family, "does not go with --truth");
  return load_truth(file, nominal);
}

}  // namespace knuckle::session
