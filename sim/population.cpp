// Which machines there are: the drawing with the errors that machines of one make have, and two families of rougher
// ones. Where the sizes come from: sim/README.md.
#include <cmath>
#include <numbers>
#include <random>

#include "core/seed.h"
#include "core/units.h"
#include "sim/rigid_body.h"
#include "sim/truth.h"

namespace knuckle::sim {
namespace {

/// How values lie about their nominal ones: evenly, or most of them near their bounds.
enum class Law : std::uint8_t { kUniform, kArcsine };

class Sampler {
 public:
  explicit Sampler(std::uint64_t seed, Law law = Law::kUniform) : generator_(seed), law_(law) {}
  double within(double bound) {
    const double u = unit_interval(generator_);
    return bound * (law_ == Law::kUniform ? 2 * u - 1 : std::sin(2 * std::numbers::pi * u));
  }
  double scaled(double value, double fraction) { return value * (1 + within(fraction)); }
  /// Between bounds; by ratio where a quantity has no typical size.
  double between(double low, double high) { return 0.5 * (low + high) + within(0.5 * (high - low)); }
  double by_ratio(double low, double high) { return std::sqrt(low * high) * std::pow(high / low, within(0.5)); }
  PlanarVector moved(const PlanarVector& pin, double bound_m) {
    const double dx = within(bound_m);
    const double dz = within(bound_m);
    return pin + PlanarVector(dx, dz);
  }

 private:
  std::mt19937_64 generator_;
  Law law_;
};

/// Bounds of what every machine has.
struct Spread {
  double pin_m, rod_m;  // a rod's length is held closer than a weldment's pins
  double mass, friction, dead_band, hysteresis, valve_Hz, valve_delay, valve_flow;
  double encoder_m, bulk, transmitter_Pa, transmitter_gain, slope_rad, tilt_rad, viscosity;
};
constexpr Spread kOneMake{2e-3, 0.5e-3, 0.05, 0.3,      0.01,  0.5,           0.15,          0.2,
                          0.05, 0.5e-3, 0.2,  1 * kBar, 0.002, 0.5 * kDegree, 0.5 * kDegree, 1.25};
constexpr Spread kAnyMake{4e-3, 1e-3, 0.12, 0.6,        0.03,  0.5,         0.25,        0.3,
                          0.1,  2e-3, 0.35, 2.5 * kBar, 0.005, 3 * kDegree, 1 * kDegree, 2.5};

void sample_geometry(MachineDescription& machine, const Spread& spread, Sampler& sample) {
  machine.links[kBoom].length_m += sample.within(spread.pin_m);
  machine.links[kArm].length_m += sample.within(spread.pin_m);
  machine.links[kBucket].length_m += sample.within(spread.pin_m);
  for (TriangleMount* mount : {&machine.boom_mount, &machine.arm_mount}) {
    mount->parent_pin_m = sample.moved(mount->parent_pin_m, spread.pin_m);
    mount->child_pin_m = sample.moved(mount->child_pin_m, spread.pin_m);
  }
  BucketLinkage& linkage = machine.bucket_linkage;
  for (PlanarVector* pin : {&linkage.cylinder_pin_m, &linkage.rocker_pin_m, &linkage.bucket_pin_m}) {
    *pin = sample.moved(*pin, spread.pin_m);
  }
  linkage.rocker_length_m += sample.within(spread.rod_m);
  linkage.coupler_length_m += sample.within(spread.rod_m);
}

void sample_masses(MachineDescription& machine, const Spread& spread, Sampler& sample) {
  for (LinkDescription& link : machine.links) {
    const double factor = sample.scaled(1, spread.mass);
    link.mass_kg *= factor;
    link.inertia_kgm2 *= factor;
  }
  for (CylinderDescription& cylinder : machine.cylinders) {
    cylinder.body_mass_kg = sample.scaled(cylinder.body_mass_kg, spread.mass);
    cylinder.rod_mass_kg = sample.scaled(cylinder.rod_mass_kg, spread.mass);
  }
  machine.bucket_linkage.rocker_mass_kg = sample.scaled(machine.bucket_linkage.rocker_mass_kg, spread.mass);
  machine.bucket_linkage.coupler_mass_kg = sample.scaled(machine.bucket_linkage.coupler_mass_kg, spread.mass);
}

void sample_valve(ValveDescription& valve, const Spread& spread, Sampler& sample) {
  valve.dead_band_extend = std::max(0.0, valve.dead_band_extend + sample.within(spread.dead_band));
  valve.dead_band_retract = std::max(0.0, valve.dead_band_retract + sample.within(spread.dead_band));
  valve.hysteresis = sample.scaled(valve.hysteresis, spread.hysteresis);
  valve.natural_frequency_Hz = sample.scaled(valve.natural_frequency_Hz, spread.valve_Hz);
  valve.delay_s = sample.scaled(valve.delay_s, spread.valve_delay);
  valve.nominal_flow_m3ps = sample.scaled(valve.nominal_flow_m3ps, spread.valve_flow);
}

void sample_friction(LuGreFriction& friction, const Spread& spread, Sampler& sample) {
  friction.coulomb_extend_N = sample.scaled(friction.coulomb_extend_N, spread.friction);
  friction.coulomb_retract_N = sample.scaled(friction.coulomb_retract_N, spread.friction);
  friction.viscous_Ns_per_m = sample.scaled(friction.viscous_Ns_per_m, spread.friction);
  friction.static_ratio = 1 + sample.scaled(friction.static_ratio - 1, spread.friction);
  friction.stribeck_mps = sample.scaled(friction.stribeck_mps, spread.friction);
  friction.presliding_m = std::max(kMinPresliding_m, sample.scaled(friction.presliding_m, spread.friction));
}

double sample_viscosity(const Spread& spread, Sampler& sample) {
  return std::exp(sample.within(std::log(spread.viscosity)));
}

/// Of the coarsest encoder.
double encoder_step_m(const MachineDescription& nominal) {
  double step_m = nominal.sensors.encoder_step_m;
  for (const NodeDescription& node : nominal.bus.nodes)
    if (node.measures_angle()) step_m = std::max(step_m, node.rotary.step_rad() * MachineTruth::kRotaryLever_m);
  for (const BroadcastFrame& frame : nominal.bus.broadcasts) {
    for (const BroadcastField& field : frame.fields) {
      const double lever_m = field.info().is_angle ? MachineTruth::kRotaryLever_m : 1;
      if (field.info().role == NodeRole::kEncoder && field.bits.type != BitField::Type::kFloat)
        step_m = std::max(step_m, std::abs(field.bits.scale) * lever_m);
    }
  }
  return step_m;
}

/// What every simulated machine has beside its drawing.
MachineTruth sample_plain(const MachineDescription& nominal, const Spread& spread, Sampler& sample) {
  MachineTruth truth = nominal_truth(nominal);
  sample_geometry(truth.machine, spread, sample);
  sample_masses(truth.machine, spread, sample);
  for (std::size_t i = 0; i < kJoints; ++i) {
    sample_valve(truth.machine.cylinders[i].valve, spread, sample);
    sample_friction(truth.friction[i], spread, sample);
    truth.encoder_offset_m[static_cast<Eigen::Index>(i)] = sample.within(spread.encoder_m);
  }
  truth.machine.hydraulics.bulk_modulus_Pa = sample.scaled(nominal.hydraulics.bulk_modulus_Pa, spread.bulk);
  for (PressureSensorError& sensor : truth.pressure) {
    sensor.offset_Pa = sample.within(spread.transmitter_Pa);
    sensor.gain = sample.scaled(1, spread.transmitter_gain);
  }
  truth.hull_pitch_rad = sample.within(spread.slope_rad);
  truth.tilt_offset_rad = sample.within(spread.tilt_rad);
  truth.viscosity_factor = sample_viscosity(spread, sample);
  const double lag_s = 5e-3 + sample.within(3e-3);  // six of one make
  for (PressureSensorError& sensor : truth.pressure) sensor.lag_s = lag_s;
  truth.encoder_noise_m = encoder_step_m(nominal) * (0.1 + sample.within(0.1));
  return truth;
}

/// Bounds of one family's rougher effects.
struct Range {
  double low, high;
};
struct Roughness {
  Range curve_exponent, notch_opening, notch_slope, retract_gain, hysteresis, stiction, null_drift_per_K;
  Range leakage_Lpm_per_100bar, seal_share, pin_share, play_m;
  double bending_m_per_N;  ///< Of the stretched arm of a machine of 3.2 m reach, at its tip.
  Range subgrade_Pa_per_m, hull_damping_ratio, settling_m_per_N;
  Range warming_K, transmitter_drift, encoder_scale, encoder_slack_m, cross_talk, ripple_Pa, regulator_Hz,
      regulator_damping;
};
constexpr Roughness kServiced{.curve_exponent = {1, 1.4},
                              .notch_opening = {0.45, 0.55},
                              .notch_slope = {0.65, 1},
                              .retract_gain = {0.9, 1.1},
                              .hysteresis = {0.005, 0.015},
                              .stiction = {0.003, 0.008},
                              .null_drift_per_K = {-2e-4, 2e-4},
                              .leakage_Lpm_per_100bar = {0.002, 0.01},
                              .seal_share = {0.005, 0.02},
                              .pin_share = {0.005, 0.02},
                              .play_m = {0.05e-3, 0.2e-3},
                              .bending_m_per_N = 3e-6,
                              .subgrade_Pa_per_m = {50e6, 100e6},
                              .hull_damping_ratio = {0.08, 0.12},
                              .settling_m_per_N = {0, 0},
                              .warming_K = {0, 15},
                              .transmitter_drift = {-0.0008, 0.0008},
                              .encoder_scale = {-5e-4, 5e-4},
                              .encoder_slack_m = {0, 0.1e-3},
                              .cross_talk = {0, 0.02},
                              .ripple_Pa = {0.1e5, 0.5e5},
                              .regulator_Hz = {5, 8},
                              .regulator_damping = {0.6, 0.9}};
constexpr Roughness kWorn{.curve_exponent = {1.4, 2.2},
                          .notch_opening = {0.3, 0.5},
                          .notch_slope = {0.25, 0.5},
                          .retract_gain = {0.8, 1.4},
                          .hysteresis = {0.03, 0.06},
                          .stiction = {0.02, 0.04},
                          .null_drift_per_K = {-1e-3, 1e-3},
                          .leakage_Lpm_per_100bar = {0.01, 0.04},
                          .seal_share = {0.03, 0.05},
                          .pin_share = {0.02, 0.05},
                          .play_m = {0.4e-3, 1e-3},
                          .bending_m_per_N = 6.5e-6,
                          .subgrade_Pa_per_m = {8e6, 30e6},
                          .hull_damping_ratio = {0.03, 0.08},
                          .settling_m_per_N = {1e-7, 5e-7},
                          .warming_K = {10, 40},
                          .transmitter_drift = {-0.0025, 0.0025},
                          .encoder_scale = {-3e-3, 3e-3},
                          .encoder_slack_m = {0.1e-3, 0.5e-3},
                          .cross_talk = {0.02, 0.08},
                          .ripple_Pa = {0.5e5, 2e5},
                          .regulator_Hz = {4, 6},
                          .regulator_damping = {0.25, 0.4}};

void roughen_joint(std::size_t i, const JointVector& lever_m, double reach, const Roughness& rough, Sampler& sample,
                   MachineTruth& truth) {
  const auto in = [&sample](const Range& range) { return sample.between(range.low, range.high); };
  const CylinderDescription& cylinder = truth.machine.cylinders[i];
  ValveRoughness& valve = truth.valve[i];
  valve.curve_exponent = in(rough.curve_exponent);
  valve.notch_opening = in(rough.notch_opening);
  valve.notch_slope = in(rough.notch_slope);
  valve.retract_gain = in(rough.retract_gain);
  valve.stiction = in(rough.stiction);
  valve.null_drift_per_K = in(rough.null_drift_per_K);
  // Gap flow: thin oil leaks more.
  valve.leakage_m3ps_per_Pa =
      in(rough.leakage_Lpm_per_100bar) * kLitrePerMinute / (100 * kBar) / truth.viscosity_factor;
  truth.machine.cylinders[i].valve.hysteresis = in(rough.hysteresis);
  const double mean_area_m2 = 0.5 * (cylinder.head_area_m2() + cylinder.rod_side_area_m2());
  truth.friction[i].seal_N_per_Pa = in(rough.seal_share) * mean_area_m2;
  truth.friction[i].pin_share = in(rough.pin_share);
  // Bending of a steel arm, as one spring at each rod: boom, arm and bucket have 1/2, 1/3 and 1/6 of it. A machine of
  // another size bends less by its reach (beams grow with it).
  constexpr PerJoint<double> kShare{1.0 / 2, 1.0 / 3, 1.0 / 6};
  constexpr double kReach_m = 3.2;
  const double bending = kShare[i] * rough.bending_m_per_N * kReach_m / reach;
  double out_m = 0;  // joint to tip
  for (std::size_t k = i; k < kJoints; ++k) out_m += truth.machine.links[k].length_m;
  const double ratio = out_m / lever_m[static_cast<Eigen::Index>(i)];
  truth.pin[i] = compliant_pin(ratio * ratio / bending, in(rough.play_m), cylinder.body_mass_kg + cylinder.rod_mass_kg);
}

/// Tracks and weight of machines of this size.
HullTruth sample_hull(const MachineDescription& machine, const Roughness& rough, Sampler& sample) {
  const double size = reach_m(machine) / 3.2;
  const double track_m = 1.2 * size, width_m = 2 * 0.23 * size;
  const double mass_kg = sample.scaled(1300 * std::pow(size, 2.4), 0.1);
  const double subgrade = sample.by_ratio(rough.subgrade_Pa_per_m.low, rough.subgrade_Pa_per_m.high);
  // Two springs at the tracks' ends that rock as evenly borne tracks do have a third of their bearing.
  HullTruth hull = hull_on_tracks(machine, mass_kg, track_m, track_m * width_m * subgrade / 6,
                                  sample.between(rough.hull_damping_ratio.low, rough.hull_damping_ratio.high));
  hull.settling_m_per_N = sample.between(rough.settling_m_per_N.low, rough.settling_m_per_N.high);
  return hull;
}

void roughen(const MachineDescription& nominal, const Roughness& rough, Sampler& sample, MachineTruth& truth) {
  const auto in = [&sample](const Range& range) { return sample.between(range.low, range.high); };
  JointVector middle;
  for (std::size_t i = 0; i < kJoints; ++i) {
    middle[static_cast<Eigen::Index>(i)] = 0.5 * (nominal.links[i].min_rad + nominal.links[i].max_rad);
  }
  const JointVector lever_m = RigidBody(nominal, 0).pose(middle).lever_m.cwiseAbs();
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    roughen_joint(i, lever_m, reach_m(nominal), rough, sample, truth);
    truth.encoder_scale[n] = in(rough.encoder_scale);
    truth.encoder_slack_m[n] = in(rough.encoder_slack_m);
  }
  truth.hull = sample_hull(nominal, rough, sample);
  truth.warm_up = {in(rough.warming_K), 60 * sample.between(15, 45)};
  for (PressureSensorError& sensor : truth.pressure) {
    sensor.drift_Pa_per_K = in(rough.transmitter_drift) * nominal.sensors.pressure_range_Pa / 10;
  }
  truth.cross_talk = in(rough.cross_talk);
  truth.pump = {in(rough.ripple_Pa), sample.between(250, 500), in(rough.regulator_Hz), in(rough.regulator_damping)};
}

}  // namespace

const char* name(Family family) noexcept {
  switch (family) {
    case Family::kSmooth:
      return "smooth";
    case Family::kServiced:
      return "serviced";
    case Family::kWorn:
      return "worn";
  }
  return "?";
}

MachineTruth sample_truth(const MachineDescription& nominal, std::uint64_t seed) {
  Sampler sample(seed);
  return sample_plain(nominal, kOneMake, sample);
}

MachineTruth sample_truth(const MachineDescription& nominal, Family family, std::uint64_t seed) {
  if (family == Family::kSmooth) return sample_truth(nominal, seed);
  const bool worn = family == Family::kWorn;
  Sampler sample(stream_seed(seed, worn ? Stream::kWorn : Stream::kServiced), worn ? Law::kArcsine : Law::kUniform);
  MachineTruth truth = sample_plain(nominal, worn ? kAnyMake : kOneMake, sample);
  roughen(nominal, worn ? kWorn : kServiced, sample, truth);
  return truth;
}

MachineTruth another_day(const MachineTruth& truth, Family family, std::uint64_t seed) {
  const bool worn = family == Family::kWorn;
  // Not the numbers that the machine was sampled from.
  Sampler sample(stream_seed(seed, Stream::kDay), worn ? Law::kArcsine : Law::kUniform);
  MachineTruth day = truth;
  day.viscosity_factor = sample_viscosity(worn ? kAnyMake : kOneMake, sample);
  for (ValveRoughness& valve : day.valve) valve.leakage_m3ps_per_Pa *= truth.viscosity_factor / day.viscosity_factor;
  return day;
}

}  // namespace knuckle::sim
