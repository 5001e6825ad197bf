// Contact as an event: a multivariate CUSUM on the high-passed contact torques, so that whatever changes slowly (bias,
// gravity errors, a load being lifted) does not count and a step does at once.
#pragma once

#include <algorithm>

#include "core/filters.h"
#include "core/joints.h"

namespace knuckle::estimation {

/// Crosier, "Multivariate generalizations of cumulative sum quality-control schemes", Technometrics 30 (1988): one sum
/// for all joints, which what points the same way lengthens. A force on the bucket loads all joints, so their
/// evidence adds up.
class ContactCusum {
 public:
  static constexpr double kHighPass_Hz = 2;
  // Chosen on an hour of free air and 192 steps of 500 N (docs/results.md); both for a step of 5 ms.
  static constexpr double kDrift = 3;      ///< k, in standard deviations of the free signal, which has three joints.
  static constexpr double kThreshold = 9;  ///< h, likewise.
  static constexpr double kReferenceStep_s = 5e-3;
  static constexpr double kClip = 10;  ///< One sample adds no more: a single outlier is no contact.

  explicit ContactCusum(double step_s) noexcept
      : slow_(kHighPass_Hz, step_s, JointVector::Zero()), weight_(step_s / kReferenceStep_s) {}

  void reset(const JointVector& torque_Nm) noexcept {
    slow_.reset(torque_Nm);
    sum_.setZero();
  }

  /// @param sigma_Nm standard deviation of the high-passed signal in free motion, per joint.
  /// @return whether the threshold was crossed in this step. The sum starts again after an alarm.
  [[nodiscard]] bool step(const JointVector& torque_Nm, const JointVector& sigma_Nm) noexcept {
    high_passed_ = torque_Nm - slow_.step(torque_Nm);
    const JointVector z = high_passed_.cwiseQuotient(sigma_Nm);
    sum_ += weight_ * kClip / std::max(z.norm(), kClip) * z;
    const double length = sum_.norm(), drift = weight_ * kDrift;
    sum_ *= length > drift ? 1 - drift / length : 0;
    const bool alarm = length - drift > kThreshold;
    if (alarm) sum_.setZero();
    return alarm;
  }
  [[nodiscard]] const JointVector& high_passed_Nm() const noexcept { return high_passed_; }

 private:
  LowPass<JointVector> slow_;
  double weight_;
  JointVector sum_ = JointVector::Zero(), high_passed_ = JointVector::Zero();
};

}  // namespace knuckle::estimation
