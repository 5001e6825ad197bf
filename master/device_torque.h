// What is added to the law's force, and what bounds it before it leaves for the device: walls at the ends of the
// working range, a watchdog over the energy that comes back to the hand, and limits of size, motor heat and slew.
#pragma once

#include <array>
#include <cstddef>

#include "core/joints.h"
#include "machine/description_fwd.h"
#include "machine/device_description.h"
#include "master/device_kinematics.h"

namespace knuckle::master {

/// Walls the hand feels where the machine's working range ends, per joint.
class JointWalls {
 public:
  /// The walls begin the machine's soft margin inside its range.
  JointWalls(const DeviceDescription& device, const MachineDescription& machine) noexcept;

  /// @param setpoint_rad not clamped to the range. @param setpoint_radps likewise.
  /// @return device joint torque [N m] pushing the set-point back inside.
  [[nodiscard]] JointVector torque(const JointVector& setpoint_rad, const JointVector& setpoint_radps) const noexcept;

 private:
  JointVector min_rad_, max_rad_, reach_m_;
  double limit_N_;
};

/// Energy through the hand's port, and the watchdog that lowers the force when it gives back more than was put in.
class EnergyPort {
 public:
  static constexpr double kReturnedLimit_J = 0.5;

  /// @param power_to_hand_W commanded torque times joint rate: positive where the device drives the hand.
  void step(double power_to_hand_W, double dt_s) noexcept;

  [[nodiscard]] double in_J() const noexcept { return in_J_; }    ///< Put in by the hand; only grows.
  [[nodiscard]] double out_J() const noexcept { return out_J_; }  ///< Given back to the hand; only grows.
  /// Share of the force to render, [0, 1]: falls within half a second while more than 0.5 J net came back in the last
  /// two seconds, rises again over five.
  [[nodiscard]] double gain() const noexcept { return gain_; }
  [[nodiscard]] double returned_in_window_J() const noexcept { return window_J_; }

 private:
  static constexpr std::size_t kSlots = 200;
  static constexpr double kSlot_s = 0.01;  // 2 s in all
  double in_J_ = 0, out_J_ = 0, gain_ = 1;
  std::array<double, kSlots> slots_J_{};
  std::size_t slot_ = 0;
  double slot_filled_s_ = 0, window_J_ = 0;
};

/// Last word on joint torques before they leave for the device: size, motor heat and slew.
class TorqueLimiter {
 public:
  explicit TorqueLimiter(const DeviceDescription& device) noexcept;

  /// Scales torques down, all alike so that the force keeps its direction, to force_limit_N at the tip, and where a
  /// motor would pass what its heat allows (I^2 t on the commanded current, below the firmware's own trip), then limits
  /// their change to slew_N_per_ms at the tip, in any direction. Non-finite torques count as zero.
  [[nodiscard]] JointVector step(const JointVector& wanted_Nm, const PlanarJacobian& jacobian, double dt_s) noexcept;
  /// The device takes no torque (off or gone): its motors cool, and the next step starts from zero.
  void rest(double dt_s) noexcept;

  /// Share of the wanted torques that the motors' heat left in the last step; 1: all.
  [[nodiscard]] double heat_share() const noexcept { return heat_share_; }
  /// What heat and size together left.
  [[nodiscard]] double share() const noexcept { return size_share_ * heat_share_; }

 private:
  /// Of torques or of their change [N]: as a tip force, and per joint for the share that no tip force explains.
  [[nodiscard]] static double size_N(const JointVector& torque_Nm, const PlanarJacobian& jacobian) noexcept;
  [[nodiscard]] double share_within_heat(const JointVector& torque_Nm) const noexcept;
  [[nodiscard]] JointVector within_slew(const JointVector& torque_Nm, const PlanarJacobian& jacobian,
                                        double dt_s) const noexcept;

  JointVector rated_Nm_, peak_share_, heat_time_s_;
  double slew_N_per_s_, limit_N_;
  JointVector heat_ = JointVector::Zero();  ///< 1 = rated current for ever.
  double size_share_ = 1, heat_share_ = 1;
  JointVector torque_Nm_ = JointVector::Zero();
};

}  // namespace knuckle::master
