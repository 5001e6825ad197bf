// The hand of a person at keyboard, gamepad or mouse, on a simulated haptic device: from the requested motion and what
// the screen shows to where the hand means to be. Above the device's wire nothing knows that it is not a real one.
#pragma once

#include "app/console/console_input.h"
#include "core/joints.h"
#include "core/time.h"
#include "machine/description_fwd.h"
#include "machine/device_description.h"
#include "master/device_kinematics.h"
#include "sim/haptic_device.h"
#include "sim/operator.h"
#include "sim/person.h"

namespace knuckle::console {

class PersonHand {
 public:
  PersonHand(const DeviceDescription& device, const MachineDescription& machine,
             const sim::LimbImpedance& limb) noexcept;

  /// Every millisecond. The hand holds the device while the person is there. While enable is held and the machine is
  /// not led it goes to the machine's pose, as a person aligns by the picture; else it moves as requested, within the
  /// device's ranges, and pushes no harder than a hand does.
  /// @param scale machine joint radians per device joint radian.
  const sim::OperatorIntent& step(Time now, const HandInput& held, const sim::OperatorView& seen,
                                  double scale) noexcept;

 private:
  [[nodiscard]] JointVector aligning(const sim::OperatorView& seen, double scale) const noexcept;
  [[nodiscard]] JointVector moving(const HandInput& held, const sim::OperatorView& seen, double scale,
                                   double dt_s) noexcept;
  [[nodiscard]] JointVector within_reach(const JointVector& joint_rad, const JointVector& hand_rad) const noexcept;

  master::DeviceKinematics kinematics_;
  JointVector device_min_rad_, device_max_rad_, machine_min_rad_, machine_max_rad_;
  double most_ahead_m_;  // of the meant tip before the hand's: the limb's spring pushes no harder

  sim::OperatorIntent intent_;
  JointVector rate_radps_ = JointVector::Zero();  // of the requested machine pose, rounded off
  Time last_{}, took_hold_{};
};

}  // namespace knuckle::console
