// From device joints to the machine's set-point: joint to joint, with scale and an offset that the clutch moves.
#pragma once

#include "core/filters.h"
#include "core/joints.h"
#include "machine/description_fwd.h"
#include "master/device_driver.h"
#include "transport/link_messages.h"

namespace knuckle::master {

/// position = clamp(scale * device angle + offset, the machine's working range). The offset
/// - is zero after the device was attached: device and machine have the same shape;
/// - makes the set-point equal the machine while the clutch is held and the machine is not led (to align);
/// - follows the hand while the clutch is held and the machine is led or holds: the set-point stays where it is.
class SetPoint {
 public:
  explicit SetPoint(const MachineDescription& machine) noexcept;

  /// @param machine_rad measured joints, or nullptr while nothing was received from the machine.
  void step(const DeviceReading& device, Mode mode, const JointVector* machine_rad) noexcept;
  /// Machine joint radians per device joint radian; keeps the set-point where it is.
  void set_scale(double scale) noexcept;

  [[nodiscard]] const JointVector& position_rad() const noexcept { return position_rad_; }
  [[nodiscard]] const JointVector& velocity_radps() const noexcept { return velocity_radps_; }
  [[nodiscard]] const JointVector& unclamped_rad() const noexcept { return unclamped_rad_; }
  [[nodiscard]] double scale() const noexcept { return scale_; }

 private:
  [[nodiscard]] JointVector clamped(const JointVector& joint_rad) const noexcept;

  JointVector min_rad_, max_rad_;
  double scale_ = 1;
  JointVector device_rad_ = JointVector::Zero();
  JointVector offset_rad_ = JointVector::Zero();
  JointVector unclamped_rad_ = JointVector::Zero();
  JointVector position_rad_ = JointVector::Zero();
  JointVector velocity_radps_ = JointVector::Zero();
  LowPass<JointVector> rate_;
  std::uint32_t attachments_ = 0;
};

}  // namespace knuckle::master
