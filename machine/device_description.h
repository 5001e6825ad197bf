// The haptic device as its file says: plain data in SI units, no behaviour.
#pragma once

#include <cstdint>
#include <string>

#include "core/joints.h"
#include "machine/control_law.h"

namespace knuckle {

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
