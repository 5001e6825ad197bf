#include "app/session/truth_file.h"

#include <numbers>

#include "machine/toml_reader.h"

namespace knuckle::session {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

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
}

void read_valve(TomlTable table, ValveDescription& valve) {
  read(table, "dead_band_extend", 0, 0.5, 1, valve.dead_band_extend);
  read(table, "dead_band_retract", 0, 0.5, 1, valve.dead_band_retract);
  read(table, "hysteresis", 0, 0.1, 1, valve.hysteresis);
  read(table, "delay_ms", 0, 100, 1e-3, valve.delay_s);
  read(table, "natural_frequency_Hz", 1, 50, 1, valve.natural_frequency_Hz);
}

void read_joint(TomlTable table, std::size_t joint, sim::MachineTruth& truth) {
  double mass_factor = 1;
  read(table, "mass_factor", 0.5, 2, 1, mass_factor);
  truth.machine.links[joint].mass_kg *= mass_factor;
  truth.machine.links[joint].inertia_kgm2 *= mass_factor;
  if (table.has("friction")) read_friction(table.table("friction"), truth.friction[joint]);
  if (table.has("valve")) read_valve(table.table("valve"), truth.machine.cylinders[joint].valve);
}

}  // namespace

sim::MachineTruth load_truth(const std::string& path, const MachineDescription& nominal) {
  sim::MachineTruth truth = sim::nominal_truth(nominal);
  TomlTable file = TomlTable::read(path);
  if (file.has("pressure_offset_bar")) {
    const auto offset_Pa = file.numbers<6>("pressure_offset_bar", -20, 20, 1e5);
    for (std::size_t i = 0; i < 6; ++i) truth.pressure[i].offset_Pa = offset_Pa[static_cast<Eigen::Index>(i)];
  }
  double lag_s = 0;
  read(file, "pressure_lag_ms", 0, 50, 1e-3, lag_s);
  for (sim::PressureSensorError& sensor : truth.pressure) sensor.lag_s = lag_s;
  if (file.has("encoder_offset_mm")) truth.encoder_offset_m = file.numbers<3>("encoder_offset_mm", -5, 5, 1e-3);
  read(file, "encoder_noise_mm", 0, 1, 1e-3, truth.encoder_noise_m);
  read(file, "hull_pitch_deg", -30, 30, kDeg, truth.hull_pitch_rad);
  read(file, "tilt_offset_deg", -5, 5, kDeg, truth.tilt_offset_rad);
  read(file, "viscosity_factor", 0.2, 5, 1, truth.viscosity_factor);
  read(file, "bulk_modulus_GPa", 0.2, 3, 1e9, truth.machine.hydraulics.bulk_modulus_Pa);
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (file.has(kJointNames[i])) read_joint(file.table(kJointNames[i]), i, truth);
  }
  file.finish();
  sim::check_truth(truth);
  return truth;
}

}  // namespace knuckle::session
