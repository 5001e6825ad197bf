// Last word on joint torques before they leave for the device: size, motor heat and slew.
#pragma once

#include "core/joints.h"
#include "machine/device_description.h"
#include "master/device_kinematics.h"

namespace knuckle::master {

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
