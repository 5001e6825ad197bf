#include "app/truth_file.h"

#include <numbers>

#include "machine/toml_reader.h"

namespace knuckle::app {
namespace {

void read_friction(TomlTable& table, sim::LuGreFriction& friction) {
  friction.coulomb_extend_N = table.number("coulomb_extend_N", 0, 1e5);
  friction.coulomb_retract_N = table.number("coulomb_retract_N", 0, 1e5);
  friction.static_ratio = table.number("static_ratio", 1, 4);
  friction.stribeck_mps = table.number("stribeck_mm_per_s", 1, 100, 1e-3);
  friction.viscous_Ns_per_m = table.number("viscous_Ns_per_m", 0, 1e6);
}

void read_valve(TomlTable& table, ValveDescription& valve) {
  valve.dead_band_extend = table.number("dead_band_extend", 0, 0.5);
  valve.dead_band_retract = table.number("dead_band_retract", 0, 0.5);
  valve.hysteresis = table.number("hysteresis", 0, 0.1);
  valve.delay_s = table.number("delay_ms", 0, 100, 1e-3);
  valve.natural_frequency_Hz = table.number("natural_frequency_Hz", 1, 50);
}

}  // namespace

sim::MachineTruth load_truth(const std::string& path, const MachineDescription& nominal) {
  constexpr double kDeg = std::numbers::pi / 180;
  sim::MachineTruth truth = sim::nominal_truth(nominal);
  TomlTable file = TomlTable::read(path);
  if (file.has("pressure_offset_bar")) {
    const auto offset = file.numbers<6>("pressure_offset_bar", -20, 20, 1e5);
    for (std::size_t i = 0; i < 6; ++i) truth.pressure[i].offset_Pa = offset[static_cast<Eigen::Index>(i)];
  }
  if (file.has("encoder_offset_mm")) truth.encoder_offset_m = file.numbers<3>("encoder_offset_mm", -50, 50, 1e-3);
  if (file.has("hull_pitch_deg")) truth.hull_pitch_rad = file.number("hull_pitch_deg", -30, 30, kDeg);
  if (file.has("tilt_offset_deg")) truth.tilt_offset_rad = file.number("tilt_offset_deg", -5, 5, kDeg);
  if (file.has("viscosity_factor")) truth.viscosity_factor = file.number("viscosity_factor", 0.2, 5);
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (!file.has(kJointNames[i])) continue;
    TomlTable joint = file.table(kJointNames[i]);
    if (joint.has("mass_factor")) truth.machine.links[i].mass_kg *= joint.number("mass_factor", 0.5, 2);
    if (joint.has("friction")) {
      TomlTable friction = joint.table("friction");
      read_friction(friction, truth.friction[i]);
    }
    if (joint.has("valve")) {
      TomlTable valve = joint.table("valve");
      read_valve(valve, truth.machine.cylinders[i].valve);
    }
  }
  file.finish();
  sim::check_truth(truth);
  return truth;
}

}  // namespace knuckle::app
