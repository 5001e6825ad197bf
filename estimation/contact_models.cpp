// Contact models beyond the tip force: inversions of two or three joint torques, with first-order covariances.
#include "estimation/contact_models.h"

#include <cmath>

#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

PlanarVector along(double angle_rad) noexcept {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}
PlanarVector normal(double angle_rad) noexcept {
  return {-std::sin(angle_rad), std::cos(angle_rad)};
}

bool finite(const JointLoad& load) noexcept {
  return load.joint_rad.allFinite() && load.torque_Nm.allFinite() && load.covariance_Nm2.allFinite() &&
         load.lever_m.allFinite();
}

/// Maps (tau_boom, tau_arm, tau_bucket) to (tau_arm - tau_bucket, tau_bucket): moments about the arm joint of a force
/// moved to the bucket joint, and about the bucket joint.
Eigen::Matrix<double, 2, 3> two_moments() noexcept {
  Eigen::Matrix<double, 2, 3> m;
  m << 0, 1, -1, 0, 0, 1;
  return m;
}

}  // namespace

OrRefusal<TipWrench> tip_wrench(const JointVector& length_m, const JointLoad& load, double strictness) noexcept {
  if (!finite(load)) return ContactRefusal::kNotFinite;
  if (std::abs(std::sin(load.joint_rad[kArm])) < strictness * kLeastSine) return ContactRefusal::kStraightArm;
  if (std::abs(load.lever_m[kBucket]) < strictness * kNearToggle_m) return ContactRefusal::kNearToggle;
  Eigen::Matrix3d transposed;  // row i: moment of (Fx, Fz, torque) at the tip about joint i
  PlanarVector from_joint = PlanarVector::Zero();
  double angle = load.joint_rad.sum();
  for (int i = kBucket; i >= 0; --i) {
    from_joint += length_m[i] * along(angle);
    transposed.row(i) << -from_joint.y(), from_joint.x(), 1;
    angle -= load.joint_rad[i];
  }
  const Eigen::Matrix3d inverse = transposed.inverse();
  return TipWrench{inverse * load.torque_Nm, inverse * load.covariance_Nm2 * inverse.transpose()};
}

OrRefusal<TwoJointForce> tip_force_of_two(const JointVector& length_m, const JointLoad& load, double place_m,
                                          double strictness) noexcept {
  if (!finite(load) || !std::isfinite(place_m)) return ContactRefusal::kNotFinite;
  if (std::abs(std::sin(load.joint_rad[kBucket])) < strictness * kLeastSine) return ContactRefusal::kBucketInLine;
  if (std::abs(load.lever_m[kBucket]) < strictness * kNearToggle_m) return ContactRefusal::kNearToggle;
  const double bucket_m = length_m[kBucket];
  if (place_m < kLeastPlace * bucket_m || place_m > (1 + kBesideBucket) * bucket_m)
    return ContactRefusal::kOffTheBucket;
  const double arm_rad = load.joint_rad[kBoom] + load.joint_rad[kArm];
  Eigen::Matrix2d rows;
  rows.row(0) = length_m[kArm] * normal(arm_rad).transpose();
  rows.row(1) = place_m * normal(arm_rad + load.joint_rad[kBucket]).transpose();
  const Eigen::Matrix<double, 2, 3> map = rows.inverse() * two_moments();
  return TwoJointForce{map * load.torque_Nm, map * load.covariance_Nm2 * map.transpose()};
}

namespace {

/// The links' angles to the force, and what it makes of the two moments.
struct AlongDirection {
  double bucket_sine = 0, N_per_moment = 0;
  Eigen::Vector2d moments_Nm;
  Eigen::Matrix2d spread_N2m2;
};

OrRefusal<AlongDirection> along_direction(const JointVector& length_m, const JointLoad& load,
                                          const PlanarVector& direction, double strictness) noexcept {
  if (!finite(load) || !direction.allFinite() || direction.norm() == 0) return ContactRefusal::kNotFinite;
  if (std::abs(load.lever_m[kBucket]) < strictness * kNearToggle_m) return ContactRefusal::kNearToggle;
  const double arm_rad = load.joint_rad[kBoom] + load.joint_rad[kArm];
  const PlanarVector unit = direction.normalized();
  const double arm_sine = normal(arm_rad).dot(unit);
  const double bucket_sine = normal(arm_rad + load.joint_rad[kBucket]).dot(unit);
  if (std::abs(arm_sine) < strictness * kLeastSine || std::abs(bucket_sine) < strictness * kLeastSine)
    return ContactRefusal::kDirectionAlongLink;
  return AlongDirection{bucket_sine, 1 / (length_m[kArm] * arm_sine), two_moments() * load.torque_Nm,
                        two_moments() * load.covariance_Nm2 * two_moments().transpose()};
}

}  // namespace

OrRefusal<ForceAtPlace> force_and_position(const JointVector& length_m, const JointLoad& load,
                                           const PlanarVector& direction, double strictness) noexcept {
  const auto along = along_direction(length_m, load, direction, strictness);
  if (const auto* refusal = std::get_if<ContactRefusal>(&along)) return *refusal;
  const auto& [bucket_sine, per_moment, moments, spread] = std::get<AlongDirection>(along);
  ForceAtPlace found;
  found.force_N = per_moment * moments[0];
  if (std::abs(found.force_N) < kLeastSigmas * std::abs(per_moment) * std::sqrt(spread(0, 0)))
    return ContactRefusal::kForceTooSmall;
  found.place_m = moments[1] / (found.force_N * bucket_sine);
  const double beside = kBesideBucket * length_m[kBucket];
  if (found.place_m < -beside || found.place_m > length_m[kBucket] + beside) return ContactRefusal::kOffTheBucket;
  Eigen::Matrix2d slope;  // d (force, place) / d moments
  slope << per_moment, 0, -found.place_m / found.force_N * per_moment, 1 / (found.force_N * bucket_sine);
  found.covariance = slope * spread * slope.transpose();
  return found;
}

OrRefusal<ForceAlong> force_along(const JointVector& length_m, const JointLoad& load, const PlanarVector& direction,
                                  double strictness) noexcept {
  const auto along = along_direction(length_m, load, direction, strictness);
  if (const auto* refusal = std::get_if<ContactRefusal>(&along)) return *refusal;
  const auto& found = std::get<AlongDirection>(along);
  return ForceAlong{found.N_per_moment * found.moments_Nm[0],
                    found.N_per_moment * found.N_per_moment * found.spread_N2m2(0, 0)};
}

}  // namespace knuckle::estimation
