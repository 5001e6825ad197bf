// What the simulated machine really is: the machine file's values with the errors a real machine, its sensors and its
// oil have. Sampled per seed (or filled from a truth file); the controller never sees it.
#pragma once

#include <array>
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
};
inline constexpr double kMinPresliding_m = 5e-5;  ///< Below it the bristle is too fast for the fixed step.

/// Reading = gain * lagged value + offset + noise, then the wire's quantisation.
struct PressureSensorError {
  double offset_Pa = 0;
  double gain = 1;
  double noise_Pa = 0;  ///< Standard deviation.
  double lag_s = 0;     ///< Time constant, first order.
};

/// Plain data. `machine` holds the true geometry, masses, cylinders and valves; in its friction and noise entries only
/// the nominal values are left, `friction` and the sensor errors below are what counts.
struct MachineTruth {
  MachineDescription machine;
  PerJoint<LuGreFriction> friction{};
  std::array<PressureSensorError, 6> pressure{};  ///< boom A, B, arm A, B, bucket A, B
  JointVector encoder_offset_m = JointVector::Zero();
  double encoder_noise_m = 0;   ///< Standard deviation, before the encoder's own steps.
  double hull_pitch_rad = 0;    ///< M's x axis above the horizontal, counter-clockwise.
  double tilt_offset_rad = 0;   ///< Error of the tilt sensor.
  double tilt_noise_rad = 0;    ///< Standard deviation.
  double viscosity_factor = 1;  ///< Oil temperature: scales viscous friction and hose drop.
};

/// The machine as its file says, LuGre friction with the file's values, perfect sensors but for the file's noise.
[[nodiscard]] MachineTruth nominal_truth(const MachineDescription& nominal);

/// One machine of the population: masses +-5 %, friction +-30 %, pins +-2 mm, transmitters +-1 bar, hull pitch and
/// tilt sensor +-0.5 deg, dead bands +-1 % of stroke, oil 0.8..1.25, transmitter lag 2..8 ms, and so on (bounds in
/// truth.cpp; all uniform).
[[nodiscard]] MachineTruth sample_truth(const MachineDescription& nominal, std::uint64_t seed);

/// The same machine with oil of another temperature, sampled as in sample_truth(); all else stays.
[[nodiscard]] MachineTruth another_day(const MachineTruth& truth, std::uint64_t seed);

/// @throws InputError naming key, value and bound where a value would break the plant's numerics.
void check_truth(const MachineTruth& truth);

}  // namespace knuckle::sim
