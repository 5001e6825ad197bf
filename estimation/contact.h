// Contact as an event: two-sided CUSUM per joint on the high-passed contact torque, so that whatever changes slowly
// (bias, gravity errors, a load being lifted) does not count and a step does at once.
#pragma once

#include <algorithm>

#include "core/filters.h"
#include "core/joints.h"

namespace knuckle::estimation {

class ContactCusum {
 public:
  static constexpr double kHighPass_Hz = 2;
  static constexpr double kDrift = 2;  ///< k, in standard deviations of the free signal.
  /// h, likewise, for a step of 5 ms. With 10, an hour of free air has four times as many false events
  /// (docs/theory.md). A hit that is clipped is noticed 6 ms later than with 10, one of four deviations 25 ms later.
  static constexpr double kThreshold = 20;
  static constexpr double kReferenceStep_s = 5e-3;
  static constexpr double kClip = 10;  ///< One sample adds no more: a single outlier is no contact.

  explicit ContactCusum(double step_s) noexcept
      : slow_(kHighPass_Hz, step_s, JointVector::Zero()), weight_(step_s / kReferenceStep_s) {}

  void reset(const JointVector& torque_Nm) noexcept {
    slow_.reset(torque_Nm);
    up_.setZero();
    down_.setZero();
  }

  /// @param sigma_Nm standard deviation of the high-passed signal in free motion, per joint.
  /// @return joint that crossed its threshold in this step, or -1. The sums start again after an alarm.
  int step(const JointVector& torque_Nm, const JointVector& sigma_Nm) noexcept {
    high_passed_ = torque_Nm - slow_.step(torque_Nm);
    int alarm = -1;
    for (int i = 0; i < kJoints; ++i) {
      const double z = std::clamp(high_passed_[i] / sigma_Nm[i], -kClip, kClip);
      up_[i] = std::max(0.0, up_[i] + weight_ * (z - kDrift));
      down_[i] = std::max(0.0, down_[i] + weight_ * (-z - kDrift));
      if (alarm < 0 && std::max(up_[i], down_[i]) > kThreshold) alarm = i;
    }
    if (alarm >= 0) {
      up_.setZero();
      down_.setZero();
    }
    return alarm;
  }
  [[nodiscard]] const JointVector& high_passed_Nm() const noexcept { return high_passed_; }

 private:
  LowPass<JointVector> slow_;
  double weight_;
  JointVector up_ = JointVector::Zero(), down_ = JointVector::Zero(), high_passed_ = JointVector::Zero();
};

}  // namespace knuckle::estimation
