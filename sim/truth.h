// What the simulated machine really is: the machine file's values with the errors a real machine, its sensors and its
// oil have. Sampled per seed (or filled from a truth file); the controller never sees it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "core/joints.h"
#include "machine/description.h"

namespace knuckle::sim {

/// LuGre friction of one cylinder (Canudas de Wit et al. 1995), Stribeck curve after Hess and Soom:
/// g(v) = F_c + (F_s - F_c) / (1 + (v / v_s)^2), F = sigma0 z + sigma1(v) z' + F_v v.
struct LuGreFriction {
  double coulomb_extend_N = 0, coulomb_retract_N = 0;  ///< F_c
  double static_ratio = 1;                             ///< F_s / F_c
  double stribeck_mps = 0.01;                          ///< v_s
  double viscous_Ns_per_m = 0;                         ///< F_v at the nominal oil temperature
  double presliding_m = 1e-4;                          ///< F_c / sigma0; at least kMinPresliding_m
  double micro_damping_Ns_per_m = 1e4;                 ///< sigma1 at v = 0
  double seal_N_per_Pa = 0;                            ///< Added to F_c: times p_A + p_B.
  double pin_share = 0;                                ///< Added to F_c: times the pressure force |p_A A_A - p_B A_B|.
};
inline constexpr double kMinPresliding_m = 5e-5;  ///< Below it the bristle is too fast for the fixed step.

/// What a valve does that its data sheet does not say. Fractions are of spool stroke.
struct ValveRoughness {
  double curve_exponent = 1;                  ///< Edge area over (opening beyond the dead band)^this,
  double notch_opening = 0, notch_slope = 1;  ///< after a notch: up to this opening with this share of the slope.
  double retract_gain = 1;                    ///< Area of the retracting edges over the extending ones'.
  double stiction = 0;                        ///< The spool stays until its target is this far away.
  double null_drift_per_K = 0;                ///< Its zero moves with the oil's warmth.
  double leakage_m3ps_per_Pa = 0;             ///< From the fuller to the emptier side of the cylinder, laminar.
};

/// What lies between a cylinder and the links it moves: worn pins and bending steel, both felt at the rod's end.
/// Without a stiffness the pins are tight and the links rigid.
struct PinTruth {
  double stiffness_N_per_m = 0;  ///< Of links and pins along the cylinder.
  double damping_Ns_per_m = 0;
  double play_m = 0;   ///< The rod moves so far without moving the link.
  double mass_kg = 0;  ///< What swings between oil and pin, in addition to the cylinder's own masses.
  [[nodiscard]] bool compliant() const noexcept { return stiffness_N_per_m > 0; }
};

/// A pump that is not smooth, and the regulator that sets it.
struct PumpTruth {
  double ripple_Pa = 0;  ///< Amplitude at a cylinder that it feeds; a tenth of that where the valve is closed.
  double ripple_Hz = 330;
  double regulator_Hz = 0;       ///< Load sensing swings at this frequency; 0: it follows with its lag alone.
  double regulator_damping = 1;  ///< Damping ratio of that.
};

/// Oil that warms up exponentially from the start on.
struct WarmUp {
  double rise_K = 0;    ///< Once it has come to rest.
  double time_s = 600;  ///< Time constant.
  [[nodiscard]] double at(double t_s) const noexcept { return rise_K * (1 - std::exp(-t_s / time_s)); }
};

/// Reading = gain * lagged value + offset + drift * warmth + noise, then the wire's quantisation.
struct PressureSensorError {
  double offset_Pa = 0;
  double drift_Pa_per_K = 0;
  double gain = 1;
  double noise_Pa = 0;  ///< Standard deviation.
  double lag_s = 0;     ///< Time constant, first order.
};

/// The hull on its tracks (hull.h). Vectors in axes M.
struct HullTruth {
  double stiffness_N_per_m = 0;  ///< Of the ground under either end of the tracks; 0: the hull stands like a rock.
  double damping_Ns_per_m = 0;
  double settling_m_per_N = 0;                   ///< What overloaded ground gives way for good; 0: nothing.
  double bearing_ratio = 1.3;                    ///< Overloaded: above this times the push at the start.
  double track_m = 0;                            ///< Between the ends.
  double mass_kg = 0, inertia_kgm2 = 0;          ///< Without the arm; about its centre of mass.
  PlanarVector com_m = PlanarVector::Zero();     ///< From the tracks' middle on the ground.
  PlanarVector centre_m = PlanarVector::Zero();  ///< The tracks' middle on the ground from the boom pin.
};

/// Plain data. `machine` holds the true geometry, masses, cylinders and valves; in its friction and noise entries only
/// the nominal values are left, `friction` and the sensor errors below are what counts.
struct MachineTruth {
  MachineDescription machine;
  PerJoint<LuGreFriction> friction{};
  PerJoint<ValveRoughness> valve{};
  PerJoint<PinTruth> pin{};
  PumpTruth pump;
  std::array<PressureSensorError, 6> pressure{};  ///< boom A, B, arm A, B, bucket A, B
  JointVector encoder_offset_m = JointVector::Zero();
  JointVector encoder_scale = JointVector::Zero();    ///< Reading grows by this share too fast: a wire that runs askew.
  JointVector encoder_slack_m = JointVector::Zero();  ///< The reading follows after this much of a reversal.
  double encoder_noise_m = 0;                         ///< Standard deviation, before the encoder's own steps.
  /// A rotary encoder's offset, slack and noise are those of a length at this lever.
  static constexpr double kRotaryLever_m = 0.5;
  double hull_pitch_rad = 0;   ///< M's x axis above the horizontal, counter-clockwise.
  double tilt_offset_rad = 0;  ///< Error of the tilt sensor.
  double tilt_noise_rad = 0;   ///< Standard deviation.
  HullTruth hull;
  WarmUp warm_up;
  double cross_talk = 0;        ///< Share of a valve's flow that full opening of another takes away.
  double viscosity_factor = 1;  ///< Oil temperature at the start: scales viscous friction and hose drop.
};

/// The machine as its file says, LuGre friction with the file's values, perfect sensors but for the file's noise.
[[nodiscard]] MachineTruth nominal_truth(const MachineDescription& nominal);

/// One machine of the population: masses +-5 %, friction +-30 %, pins +-2 mm, transmitters +-1 bar, hull pitch and
/// tilt sensor +-0.5 deg, dead bands +-1 % of stroke, oil 0.8..1.25, transmitter lag 2..8 ms, and so on (bounds in
/// population.cpp; all uniform).
[[nodiscard]] MachineTruth sample_truth(const MachineDescription& nominal, std::uint64_t seed);

/// Which machines are sampled from.
enum class Family : std::uint8_t {
  kSmooth,    ///< As above: valves, pins, ground and pump are as good as their data sheets.
  kServiced,  ///< A machine in good service, with every effect a real one has; priors and ensembles may know these.
  kWorn,      ///< A worn one on soft ground, of any make, sampled by another law: nothing is fitted to these.
};
[[nodiscard]] const char* name(Family family) noexcept;
[[nodiscard]] MachineTruth sample_truth(const MachineDescription& nominal, Family family, std::uint64_t seed);

/// The same machine with oil of another temperature, sampled as its family's; gaps leak accordingly, all else stays.
[[nodiscard]] MachineTruth another_day(const MachineTruth& truth, Family family, std::uint64_t seed);

/// A hull on tracks as machines of this size have them. @param stiffness_N_per_m of the ground under either end;
/// @param damping_ratio of half the hull's mass on it.
[[nodiscard]] HullTruth hull_on_tracks(const MachineDescription& machine, double mass_kg, double track_m,
                                       double stiffness_N_per_m, double damping_ratio);

/// A compliant pin with the damping of steel and grease. A light cylinder on a stiff pin is made as heavy as the step
/// needs: a part of what the arm weighs at its lever.
[[nodiscard]] PinTruth compliant_pin(double stiffness_N_per_m, double play_m, double mass_kg) noexcept;

/// @throws InputError naming key, value and bound where a value would break the plant's numerics.
void check_truth(const MachineTruth& truth);

}  // namespace knuckle::sim
