#include "sim/truth.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/error.h"

namespace knuckle::sim {
namespace {

// Of half a millisecond's step; and what acts on a rod beside its pin: its stop, oil, bristles.
constexpr double kFastestRod_1ps2 = 4e6, kAroundRod_N_per_m = 8e7;
constexpr double kFastestHull_1ps2 = 2e6, kFastestHull_1ps = 1e3;

[[noreturn]] void refuse(const MachineTruth& truth, int joint, const char* key, double value, const char* bound) {
  std::ostringstream line;
  line << (truth.machine.source.empty() ? "truth" : truth.machine.source) << ": "
       << kJointNames[static_cast<std::size_t>(joint)] << "." << key << " = " << value << ": must be " << bound;
  throw InputError(line.str());
}

/// Ground on which the hull would swing too fast for the step.
void check_hull(const MachineTruth& truth) {
  const HullTruth& hull = truth.hull;
  if (hull.stiffness_N_per_m <= 0) return;
  const double lever2_m2 = hull.track_m * hull.track_m / 4;
  const double inverse = std::max(2 / hull.mass_kg, 2 * lever2_m2 / hull.inertia_kgm2);
  if (hull.stiffness_N_per_m * inverse <= kFastestHull_1ps2 && hull.damping_Ns_per_m * inverse <= kFastestHull_1ps)
    return;
  std::ostringstream line;
  line << (truth.machine.source.empty() ? "truth" : truth.machine.source)
       << ": hull.ground_stiffness_kN_per_mm = " << hull.stiffness_N_per_m / 1e6 << ": must be at most "
       << kFastestHull_1ps2 / inverse / 1e6 << " under a hull of this mass and track, and its damping at most "
       << kFastestHull_1ps / inverse / 1e3 << " kNs/m";
  throw InputError(line.str());
}

}  // namespace

MachineTruth nominal_truth(const MachineDescription& nominal) {
  MachineTruth truth;
  truth.machine = nominal;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const FrictionDescription& friction = nominal.cylinders[i].friction;
    truth.friction[i].coulomb_extend_N = truth.friction[i].coulomb_retract_N = friction.coulomb_N;
    truth.friction[i].static_ratio = friction.static_ratio;
    truth.friction[i].stribeck_mps = friction.stribeck_mps;
    truth.friction[i].viscous_Ns_per_m = friction.viscous_Ns_per_m;
  }
  for (PressureSensorError& sensor : truth.pressure) sensor.noise_Pa = nominal.sensors.pressure_noise_Pa;
  truth.tilt_noise_rad = nominal.sensors.tilt_noise_rad;
  return truth;
}

HullTruth hull_on_tracks(const MachineDescription& machine, double mass_kg, double track_m, double stiffness_N_per_m,
                         double damping_ratio) {
  const double reach = reach_m(machine);
  HullTruth hull;
  hull.mass_kg = mass_kg;
  hull.track_m = track_m;
  hull.stiffness_N_per_m = stiffness_N_per_m;
  hull.damping_Ns_per_m = 2 * damping_ratio * std::sqrt(stiffness_N_per_m * mass_kg / 2);
  hull.inertia_kgm2 = mass_kg * (track_m * track_m + 0.1 * reach * reach) / 10;
  hull.com_m = {-0.08 * track_m, 0.18 * reach};
  hull.centre_m = {-0.22 * reach, ground_level_m(machine)};
  return hull;
}

PinTruth compliant_pin(double stiffness_N_per_m, double play_m, double mass_kg) noexcept {
  constexpr double kDampingRatio = 0.3;  // of rod on pin; of the arm on the same spring it is about 0.01
  mass_kg = std::max(mass_kg, (stiffness_N_per_m + kAroundRod_N_per_m) / kFastestRod_1ps2);
  return {stiffness_N_per_m, 2 * kDampingRatio * std::sqrt(stiffness_N_per_m * mass_kg), play_m, mass_kg};
}

void check_truth(const MachineTruth& truth) {
  check_hull(truth);
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto i = static_cast<std::size_t>(joint);
    const LuGreFriction& friction = truth.friction[i];
    const CylinderDescription& cylinder = truth.machine.cylinders[i];
    if (!(friction.presliding_m >= kMinPresliding_m)) {
      refuse(truth, joint, "presliding_m", friction.presliding_m, "at least 5e-5 m");
    }
    if (!(friction.coulomb_extend_N > 0)) {
      refuse(truth, joint, "coulomb_extend_N", friction.coulomb_extend_N, "above 0 N");
    }
    if (!(friction.coulomb_retract_N > 0)) {
      refuse(truth, joint, "coulomb_retract_N", friction.coulomb_retract_N, "above 0 N");
    }
    if (!(friction.static_ratio >= 1)) refuse(truth, joint, "static_ratio", friction.static_ratio, "at least 1");
    if (!(friction.stribeck_mps > 0)) refuse(truth, joint, "stribeck_mps", friction.stribeck_mps, "above 0 m/s");
    if (!(cylinder.valve.delay_s >= 0 && cylinder.valve.delay_s <= 0.2)) {
      refuse(truth, joint, "valve.delay_s", cylinder.valve.delay_s, "0 to 0.2 s");
    }
    const PinTruth& pin = truth.pin[i];
    if (pin.compliant() && !(pin.stiffness_N_per_m + kAroundRod_N_per_m <= 1.001 * kFastestRod_1ps2 * pin.mass_kg)) {
      refuse(truth, joint, "pins.stiffness", pin.stiffness_N_per_m, "at most 4e6 1/s^2 times its mass, less 8e7 N/m");
    }
    if (!(cylinder.valve.dead_band_extend < 1 && cylinder.valve.dead_band_retract < 1)) {
      refuse(truth, joint, "valve.dead_band", cylinder.valve.dead_band_extend, "below 1 of stroke");
    }
  }
}

}  // namespace knuckle::sim
