// The three-joint haptic device and the limb that holds it, integrated as one body, with the firmware between the
// motors and the cable. Steps by one millisecond.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/joints.h"
#include "core/time.h"
#include "machine/device_description.h"
#include "sim/device_firmware.h"
#include "sim/person.h"
#include "sim/truth.h"
#include "transport/hid_port.h"

namespace knuckle::sim {

// What a haptic device really is: the device file's values with the errors that motors, gears and assembly leave.

struct DeviceTruth {
  DeviceTruth() = default;
  /// A device is as its file says unless something else is said.
  DeviceTruth(const DeviceDescription& description) : described(description), built(description) {}
  DeviceDescription described;                     ///< What its firmware reports: the file's values.
  DeviceDescription built;                         ///< What motors, gears and joints are.
  JointVector backlash_rad = JointVector::Zero();  ///< At the joints.
};

/// A smooth one is as its file says. Serviced: torque constants +-3 %, joints' zeros +-0.1 deg. Worn: +-10 %, +-0.5
/// deg, friction up to 5 times and cogging up to 3 times as large, backlash to 0.3 deg. Sources: sim/README.md.
[[nodiscard]] DeviceTruth sample_device(const DeviceDescription& nominal, Family family, std::uint64_t seed);

/// Where the operator means the device's joints to be, and which buttons are held.
struct OperatorIntent {
  JointVector joint_rad = JointVector::Zero();
  JointVector rate_radps = JointVector::Zero();
  bool presence = false;  ///< The limb holds the device; without it the device moves freely.
  bool enable = false, clutch = false, stop = false;
  PlanarVector push_N = PlanarVector::Zero();  ///< Of the muscles on the fingertip, beside the limb's spring: tremor.
  double grip = 1;                             ///< Share of the limb that holds; less where the hand slips.
};

/// What truly happens, known to no controller. Tip: the device's tip in its own frame D.
struct HandTruth {
  JointVector joint_rad = JointVector::Zero();
  JointVector rate_radps = JointVector::Zero();
  PlanarVector tip_m = PlanarVector::Zero();
  PlanarVector tip_mps = PlanarVector::Zero();
  JointVector motor_torque_Nm = JointVector::Zero();  ///< At the joints: current times constant times gear, no cogging.
  PlanarVector felt_N = PlanarVector::Zero();     ///< Tip force on the hand that explains motor_torque_Nm best (least
                                                  ///< squares over three joints): what is rendered.
  PlanarVector contact_N = PlanarVector::Zero();  ///< Force of the device on the hand at the tip, the device's own
                                                  ///< inertia, friction and cogging included; zero without a hand.
  double energy_to_hand_J = 0;                    ///< Net work of the motors on the joints since the start.
  PerJoint<double> motor_heat{};                  ///< 1 = what rated current holds for ever.
};

/// Dynamics, per joint i, posture q, with the limb's tip mass etc. through the tip Jacobian J(q), e = (1 1 1):
///   (diag(I_link + gear^2 I_rotor) + m J^T J + I_w e^T e) q'' = tau_motor + tau_cogging - friction - viscous q'
///     + J^T (K (x(q_intent) - x(q)) + B (v_intent - J q')) + e^T (wrist likewise)
/// Link inertia is diagonal and the device is weight-balanced (no gravity, no Coriolis terms: hand speeds are below
/// 1 m/s and links weigh grams). Friction is a Dahl bristle. Velocity is stepped implicitly in the limb's and the
/// joints' damping and stiffness, four times a millisecond, with J of the millisecond's start.
class HandAndDevice {
 public:
  /// @param cable the device's end of the HID cable; outlives this. @param seed samples friction (+-20 %) and cogging
  /// phase. @param serial 0: as the device's file says, or 1.
  HandAndDevice(const DeviceTruth& device, const LimbImpedance& limb, HidPort& cable, std::uint64_t seed,
                const JointVector& start_rad, std::uint32_t serial = 0);

  /// Moves hand and device by 1 ms, up to `now`; then one cycle of the firmware: commands in, report out, and the
  /// currents for the next millisecond.
  void step(Time now, const OperatorIntent& intent) noexcept;

  [[nodiscard]] const HandTruth& truth() const noexcept { return truth_; }
  [[nodiscard]] DeviceFirmware& firmware() noexcept { return firmware_; }

 private:
  struct Posture {
    PlanarVector tip_m = PlanarVector::Zero();
    Eigen::Matrix<double, 2, 3> jacobian;
  };
  struct IntendedMotion;
  [[nodiscard]] Posture posture_at(const JointVector& joint_rad) const noexcept;
  void substep(const IntendedMotion& intended, const Eigen::Matrix3d& inverse_mass) noexcept;
  [[nodiscard]] JointVector friction(double dt_s) noexcept;
  [[nodiscard]] JointVector cogging() const noexcept;
  void drive_motors() noexcept;
  void cross_backlash(double dt_s) noexcept;
  [[nodiscard]] PerJoint<std::int32_t> counts() const noexcept;

  DeviceDescription device_;  // as built
  JointVector backlash_rad_;
  LimbImpedance limb_;
  DeviceFirmware firmware_;
  JointVector rotor_inertia_kgm2_, joint_inertia_kgm2_, friction_Nm_, cogging_phase_rad_;
  JointVector motor_rad_, motor_radps_ = JointVector::Zero();  // at the joints; elsewhere than these in a gear's play
  JointVector bristle_rad_ = JointVector::Zero();
  PerJoint<double> asked_A_{}, current_A_{};
  double current_follows_;  // what the current makes up for of its error in a substep
  HandTruth truth_;
  Posture posture_;  // the Jacobian of the last step's end, the tip as it moves on
};

}  // namespace knuckle::sim
