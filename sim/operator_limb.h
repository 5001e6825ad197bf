// Mechanical impedance of the limb that holds the haptic device. What the operator *wants* is not here.
#pragma once

#include <cstdint>
#include <limits>

namespace knuckle::sim {

/// How the operator holds the device.
enum class LimbClass : std::uint8_t { kRelaxed, kNormal, kCoContracted, kLightGrip };
[[nodiscard]] const char* name(LimbClass limb) noexcept;

/// Mass, damping and stiffness of the hand at the fingertip (the device's tip, the same in every direction of the
/// plane), and of the wrist about the finger's absolute angle. They act on the device's joints through the device's
/// own Jacobian J and the row of ones e = (1 1 1): M = m J^T J + I e^T e, likewise damping; the springs pull between
/// the tip and finger angle and where the operator means them to be, so they are conservative in every posture.
struct LimbImpedance {
  double mass_kg = 0;
  double damping_Ns_per_m = 0;
  double stiffness_N_per_m = 0;
  double wrist_inertia_kgm2 = 0;
  double wrist_damping_Nms = 0;
  double wrist_stiffness_Nm = 0;                                ///< Per radian.
  double strength_N = std::numeric_limits<double>::infinity();  ///< Most that the springs and dampers of the hand pull.
};

/// One limb sampled log-uniformly from its class's ranges; the same for the same seed.
[[nodiscard]] LimbImpedance sample_limb(LimbClass limb, std::uint64_t seed) noexcept;

}  // namespace knuckle::sim
