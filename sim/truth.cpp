#include "sim/truth.h"

#include <cmath>
#include <random>
#include <sstream>

#include "core/error.h"
#include "core/seed.h"

namespace knuckle::sim {
namespace {

constexpr double kBar = 1e5;
constexpr double kDegree = std::numbers::pi / 180;

/// Uniform about a nominal value.
class Sampler {
 public:
  explicit Sampler(std::uint64_t seed) : generator_(seed) {}
  double within(double bound) { return bound * (2 * unit_interval(generator_) - 1); }
  double scaled(double value, double fraction) { return value * (1 + within(fraction)); }
  PlanarVector moved(const PlanarVector& pin, double bound_m) {
    const double dx = within(bound_m);
    const double dz = within(bound_m);
    return pin + PlanarVector(dx, dz);
  }

 private:
  std::mt19937_64 generator_;
};

void sample_geometry(MachineDescription& machine, Sampler& sample) {
  constexpr double kPin_m = 2e-3;
  constexpr double kRod_m = 0.5e-3;  // a rod's length is held closer than a weldment's pins
  machine.links[kBoom].length_m += sample.within(kPin_m);
  machine.links[kArm].length_m += sample.within(kPin_m);
  machine.links[kBucket].length_m += sample.within(kPin_m);
  for (TriangleMount* mount : {&machine.boom_mount, &machine.arm_mount}) {
    mount->parent_pin_m = sample.moved(mount->parent_pin_m, kPin_m);
    mount->child_pin_m = sample.moved(mount->child_pin_m, kPin_m);
  }
  BucketLinkage& linkage = machine.bucket_linkage;
  for (PlanarVector* pin : {&linkage.cylinder_pin_m, &linkage.rocker_pin_m, &linkage.bucket_pin_m}) {
    *pin = sample.moved(*pin, kPin_m);
  }
  linkage.rocker_length_m += sample.within(kRod_m);
  linkage.coupler_length_m += sample.within(kRod_m);
}

void sample_masses(MachineDescription& machine, Sampler& sample) {
  constexpr double kMass = 0.05;
  for (LinkDescription& link : machine.links) {
    const double factor = sample.scaled(1, kMass);
    link.mass_kg *= factor;
    link.inertia_kgm2 *= factor;
  }
  for (CylinderDescription& cylinder : machine.cylinders) {
    cylinder.body_mass_kg = sample.scaled(cylinder.body_mass_kg, kMass);
    cylinder.rod_mass_kg = sample.scaled(cylinder.rod_mass_kg, kMass);
  }
  machine.bucket_linkage.rocker_mass_kg = sample.scaled(machine.bucket_linkage.rocker_mass_kg, kMass);
  machine.bucket_linkage.coupler_mass_kg = sample.scaled(machine.bucket_linkage.coupler_mass_kg, kMass);
}

void sample_valve(ValveDescription& valve, Sampler& sample) {
  valve.dead_band_extend = std::max(0.0, valve.dead_band_extend + sample.within(0.01));
  valve.dead_band_retract = std::max(0.0, valve.dead_band_retract + sample.within(0.01));
  valve.hysteresis = sample.scaled(valve.hysteresis, 0.5);
  valve.natural_frequency_Hz = sample.scaled(valve.natural_frequency_Hz, 0.15);
  valve.delay_s = sample.scaled(valve.delay_s, 0.2);
  valve.nominal_flow_m3ps = sample.scaled(valve.nominal_flow_m3ps, 0.05);
}

void sample_friction(LuGreFriction& friction, Sampler& sample) {
  constexpr double kFriction = 0.3;
  friction.coulomb_extend_N = sample.scaled(friction.coulomb_extend_N, kFriction);
  friction.coulomb_retract_N = sample.scaled(friction.coulomb_retract_N, kFriction);
  friction.viscous_Ns_per_m = sample.scaled(friction.viscous_Ns_per_m, kFriction);
  friction.static_ratio = 1 + sample.scaled(friction.static_ratio - 1, kFriction);
  friction.stribeck_mps = sample.scaled(friction.stribeck_mps, kFriction);
  friction.presliding_m = sample.scaled(friction.presliding_m, kFriction);
}

double sample_viscosity(Sampler& sample) {
  return std::exp(sample.within(std::log(1.25)));
}

[[noreturn]] void refuse(const MachineTruth& truth, int joint, const char* key, double value, const char* bound) {
  std::ostringstream line;
  line << (truth.machine.source.empty() ? "truth" : truth.machine.source) << ": "
       << kJointNames[static_cast<std::size_t>(joint)] << "." << key << " = " << value << ": must be " << bound;
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

MachineTruth sample_truth(const MachineDescription& nominal, std::uint64_t seed) {
  Sampler sample(seed);
  MachineTruth truth = nominal_truth(nominal);
  sample_geometry(truth.machine, sample);
  sample_masses(truth.machine, sample);
  for (std::size_t i = 0; i < kJoints; ++i) {
    sample_valve(truth.machine.cylinders[i].valve, sample);
    sample_friction(truth.friction[i], sample);
    truth.encoder_offset_m[static_cast<Eigen::Index>(i)] = sample.within(0.5e-3);
  }
  truth.machine.hydraulics.bulk_modulus_Pa = sample.scaled(nominal.hydraulics.bulk_modulus_Pa, 0.2);
  for (PressureSensorError& sensor : truth.pressure) {
    sensor.offset_Pa = sample.within(1 * kBar);
    sensor.gain = sample.scaled(1, 0.002);
  }
  truth.hull_pitch_rad = sample.within(0.5 * kDegree);
  truth.tilt_offset_rad = sample.within(0.5 * kDegree);
  truth.viscosity_factor = sample_viscosity(sample);
  const double lag_s = 5e-3 + sample.within(3e-3);  // six of one make
  for (PressureSensorError& sensor : truth.pressure) sensor.lag_s = lag_s;
  truth.encoder_noise_m = nominal.sensors.encoder_step_m * (0.1 + sample.within(0.1));
  return truth;
}

MachineTruth another_day(const MachineTruth& truth, std::uint64_t seed) {
  Sampler sample(stream_seed(seed, Stream::kDay));  // not the numbers that the machine was sampled from
  MachineTruth day = truth;
  day.viscosity_factor = sample_viscosity(sample);
  return day;
}

void check_truth(const MachineTruth& truth) {
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
    if (!(cylinder.valve.dead_band_extend < 1 && cylinder.valve.dead_band_retract < 1)) {
      refuse(truth, joint, "valve.dead_band", cylinder.valve.dead_band_extend, "below 1 of stroke");
    }
  }
}

}  // namespace knuckle::sim
