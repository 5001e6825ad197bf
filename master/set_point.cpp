// Scale, offset and clutch.
#include "master/set_point.h"

#include "machine/description.h"

namespace knuckle::master {
namespace {

constexpr double kSetPointStep_s = 1e-3;

bool leads(Mode mode) noexcept {
  return mode == Mode::kEngaged || mode == Mode::kHold;
}

}  // namespace

// The velocity sent ahead is 5 ms late, and quiet at encoder steps.
SetPoint::SetPoint(const MachineDescription& machine) noexcept
    : rate_(kSetPointRateCutoff_Hz, kSetPointStep_s, JointVector::Zero()) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    min_rad_[static_cast<Eigen::Index>(i)] = machine.links[i].min_rad;
    max_rad_[static_cast<Eigen::Index>(i)] = machine.links[i].max_rad;
  }
}

JointVector SetPoint::clamped(const JointVector& joint_rad) const noexcept {
  return joint_rad.cwiseMax(min_rad_).cwiseMin(max_rad_);
}

void SetPoint::set_scale(double scale) noexcept {
  offset_rad_ += (scale_ - scale) * device_rad_;
  scale_ = scale;
}

void SetPoint::step(const DeviceReading& device, Mode mode, const JointVector* machine_rad) noexcept {
  if (device.attachments != attachments_) {
    attachments_ = device.attachments;
    offset_rad_.setZero();
  }
  device_rad_ = device.joint_rad;
  const JointVector scaled_rad = scale_ * device_rad_;
  if (device.clutch && leads(mode)) {
    offset_rad_ = position_rad_ - scaled_rad;
  } else if (device.clutch && machine_rad != nullptr) {
    offset_rad_ = clamped(*machine_rad) - scaled_rad;
  }
  unclamped_rad_ = scaled_rad + offset_rad_;
  position_rad_ = clamped(unclamped_rad_);
  rate_.step(device.clutch || !device.ok ? JointVector(JointVector::Zero()) : JointVector(scale_ * device.rate_radps));
  velocity_radps_ = rate_.value();
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const double outward = unclamped_rad_[i] - position_rad_[i];
    if (outward * velocity_radps_[i] > 0) velocity_radps_[i] = 0;  // held by the working range
  }
}

}  // namespace knuckle::master
