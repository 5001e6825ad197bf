// The haptic device as its file says: plain data in SI units, no behaviour.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/joints.h"

namespace knuckle {

// The haptic device's three joints: each leads the machine's joint of the same index.

inline constexpr PerJoint<const char*> kDeviceJointNames{"forearm", "wrist", "finger"};

// The bilateral laws by name, as device files and --control name them. What each does: docs/theory.md.

enum class ControlLaw : std::uint8_t {
  kEchoSpring,  ///< the default: a local spring, corrected by what comes back
  kCues,        ///< no force: contact, overload and load are signalled
  kDirect,      ///< raw force reflection: unstable over delay, a baseline for simulated sessions that leads no machine
};
inline constexpr std::array<const char*, 3> kControlLawNames{"echo", "cues", "direct"};
inline constexpr const char* kControlLawChoice = "must be echo, cues or direct";
inline constexpr const char* kLeadingLawChoice = "must be echo or cues: no other law leads a machine";

[[nodiscard]] constexpr const char* name(ControlLaw law) noexcept {
  return kControlLawNames[static_cast<std::size_t>(law)];
}
/// nullopt: no such law.
[[nodiscard]] constexpr std::optional<ControlLaw> control_law_named(std::string_view name) noexcept {
  for (std::size_t i = 0; i < kControlLawNames.size(); ++i) {
    if (name == kControlLawNames[i]) return static_cast<ControlLaw>(i);
  }
  return std::nullopt;
}
/// nullopt: no such law, or one that leads no machine.
[[nodiscard]] constexpr std::optional<ControlLaw> leading_law_named(std::string_view name) noexcept {
  const auto law = control_law_named(name);
  return law == ControlLaw::kDirect ? std::nullopt : law;
}

/// Haptic device: three revolute joints shaped like the machine's arm (forearm, wrist, finger).
struct DeviceDescription {
  std::string name;
  std::string source, text;                   ///< File it was read from, and that file's text.
  JointVector link_m = JointVector::Zero();   ///< forearm, hand, finger
  PerJoint<double> min_rad{}, max_rad{};      ///< Machine-like joint angles.
  PerJoint<std::uint32_t> counts_per_turn{};  ///< At the motor.
  PerJoint<double> gear_ratio{};
  PerJoint<double> torque_constant_Nm_per_A{};
  PerJoint<double> rated_current_A{}, peak_current_A{};
  PerJoint<double> rotor_inertia_kgm2{};          ///< At the motor.
  PerJoint<double> link_inertia_kgm2{};           ///< At the joint.
  PerJoint<double> friction_Nm{}, viscous_Nms{};  ///< At the joint.
  PerJoint<double> cogging_Nm{};                  ///< At the joint, amplitude.
  PerJoint<int> cogging_periods{};                ///< Per motor turn.
  PerJoint<double> thermal_time_constant_s{};     ///< For I^2 t.
  PerJoint<int> joint_sign{};
  PerJoint<std::int32_t> zero_counts{};
  /// The one device that signs and zeros were measured on; 0: any, and the device's own word for its zeros counts.
  std::uint32_t serial = 0;
  double watchdog_s = 0.02;
  /// Values of the bilateral law on the hand's side (docs of the echo spring).
  struct Feel {
    double position_scale = 10;    ///< mu
    double force_scale = 1e-3;     ///< lambda
    double spring_N_per_m = 1000;  ///< K_l = lambda mu Ks
    double anchor_time_s = 0.15;   ///< t_w
    double bias_time_s = 0.5;      ///< tau_b at RTT 0
    double bias_time_per_rtt = 1;
    double damping_Ns_per_m = 40;  ///< b_c
    double bias_limit_N = 2.5;
    double force_limit_N = 8;  ///< At the hand.
    double slew_N_per_ms = 0.4;
    double on_N = 0.3, off_N = 0.1;  ///< R_on floor, R_off
    ControlLaw law = ControlLaw::kEchoSpring;
  } feel;
};

}  // namespace knuckle
