#include "estimation/contact_force.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"

namespace knuckle::estimation {
ContactForce::ContactForce(const MachineDescription& machine, double step_s) noexcept
    : force_(machine.force),
      length_m_(machine.links[kBoom].length_m, machine.links[kArm].length_m, machine.links[kBucket].length_m),
      bucket_(machine),
      step_s_(step_s) {
  if (force_.direction == ForceDirection::kFixed) direction_ = force_.fixed_direction.normalized();
}

void ContactForce::restart() noexcept {
  plain_ = loaded_ = {};
  if (force_.direction == ForceDirection::kAgainstMotion) direction_.reset();
}

/// What has come to rest against something keeps the direction that it came with.
void ContactForce::follow(const ContactPose& pose) noexcept {
  const double pitch = pose.hull_pitch_rad;
  if (force_.direction == ForceDirection::kPlumb) direction_ = PlanarVector(-std::sin(pitch), -std::cos(pitch));
  if (force_.direction == ForceDirection::kAgainstMotion && pose.tip_mps.norm() > kLeastMotion_mps) {
    const PlanarVector against = -pose.tip_mps.normalized();
    const PlanarVector turned =
        direction_ ? PlanarVector(*direction_ + step_s_ / kTurning_s * (against - *direction_)) : against;
    direction_ = turned.norm() > 0.1 ? PlanarVector(turned.normalized()) : against;
  }
}

/// Across the direction nothing is known: so says the covariance. Of a force too small to have a place it is not known
/// where along the bucket it acts.
OrRefusal<ContactForce::Found> ContactForce::along_direction(const JointLoad& load, double strictness) const noexcept {
  if (!direction_) return ContactRefusal::kNoDirection;
  const PlanarVector& unit = *direction_;
  const auto along = force_along(length_m_, load, unit, strictness);
  if (const auto* refusal = std::get_if<ContactRefusal>(&along)) return *refusal;
  const auto& [force_N, variance_N2] = std::get<ForceAlong>(along);
  Found found;
  found.sigma_N = std::sqrt(std::max(0.0, variance_N2));
  found.load.force_N = force_N * unit;
  const PlanarVector across(-unit.y(), unit.x());
  found.load.covariance_N2 =
      variance_N2 * unit * unit.transpose() + kForcePrior_N * kForcePrior_N * across * across.transpose();
  const double bucket_rad = load.joint_rad.sum();
  const double per_place = cross({std::cos(bucket_rad), std::sin(bucket_rad)}, unit);  // of the torque, per newton
  const double bucket_m = length_m_[kBucket];
  const auto placed = force_and_position(length_m_, load, unit, strictness);
  if (const auto* refusal = std::get_if<ContactRefusal>(&placed)) {
    if (*refusal != ContactRefusal::kForceTooSmall) return *refusal;
    found.load.torque_Nm = -0.5 * bucket_m * per_place * force_N;
    found.load.torque_variance_N2m2 = std::pow(bucket_m * per_place, 2) * (variance_N2 + force_N * force_N / 12);
    return found;
  }
  const auto& place = std::get<ForceAtPlace>(placed);
  const double from_tip_m = place.place_m - bucket_m;
  const Eigen::Vector2d slope(per_place * from_tip_m, per_place * force_N);  // d torque / d (force, place)
  found.load.torque_Nm = per_place * from_tip_m * force_N;
  found.load.torque_variance_N2m2 = std::max(0.0, slope.dot(place.covariance * slope));
  found.load.covariance_N2m = place.covariance.row(0).dot(slope) * unit;
  return found;
}

/// A model that lacks a torque it needs answers as bucket_force does, which needs no particular one.
OrRefusal<ContactForce::Found> ContactForce::solve(const ContactPose& pose, const JointVector& torque_Nm,
                                                   const Eigen::Matrix3d& covariance_Nm2,
                                                   double strictness) const noexcept {
  const bool two_known = torque_known(covariance_Nm2, kArm) && torque_known(covariance_Nm2, kBucket);
  const auto found = [](const BucketLoad& load) { return Found{load, largest_sigma(load.covariance_N2)}; };
  const auto at_tip = [&](const Eigen::Matrix3d& covariance) {
    return largest_sigma(solve_tip_force(pose.jacobian, torque_Nm, covariance).covariance_N2);
  };
  JointLoad load{pose.joints_rad, pose.lever_m, torque_Nm, covariance_Nm2};
  if (model() == ContactModel::kTipWrench && all_torques_known(covariance_Nm2)) {
    const auto solved = tip_wrench(length_m_, load, strictness);
    if (const auto* refusal = std::get_if<ContactRefusal>(&solved)) return *refusal;
    const auto& [wrench, covariance] = std::get<TipWrench>(solved);
    return found({wrench.head<2>(), covariance.topLeftCorner<2, 2>(), wrench[2], std::max(0.0, covariance(2, 2)),
                  covariance.topRightCorner<2, 1>(), 0});
  }
  if (model() == ContactModel::kBucketForce || model() == ContactModel::kTipWrench || !two_known)
    return all_torques_known(covariance_Nm2)
               ? found(bucket_.solve(pose.joints_rad, pose.jacobian, torque_Nm, covariance_Nm2))
               : Found{bucket_.at_tip(pose.joints_rad, pose.jacobian, torque_Nm, covariance_Nm2),
                       at_tip(covariance_Nm2)};
  load.covariance_Nm2.row(kBoom).setZero();
  load.covariance_Nm2.col(kBoom).setZero();
  if (model() == ContactModel::kForceAndPosition) return along_direction(load, strictness);
  const auto solved = tip_force_of_two(length_m_, load, length_m_[kBucket], strictness);
  if (const auto* refusal = std::get_if<ContactRefusal>(&solved)) return *refusal;
  Eigen::Matrix3d without_boom = covariance_Nm2;
  without_boom(kBoom, kBoom) = kUnknownVariance;
  return Found{bucket_.at_tip(pose.joints_rad, pose.jacobian, torque_Nm, without_boom), at_tip(without_boom)};
}

void ContactForce::step(const ContactPose& pose, const JointVector& torque_Nm, const JointVector& loaded_Nm,
                        const Eigen::Matrix3d& covariance_Nm2) noexcept {
  follow(pose);
  step(plain_, pose, torque_Nm, covariance_Nm2);
  step(loaded_, pose, loaded_Nm, covariance_Nm2);
  answer_ = plain_.answer;
  answer_.share = std::min(plain_.answer.share, loaded_.answer.share);
  if (!answer_.refusal) answer_.refusal = loaded_.answer.refusal;
}

void ContactForce::step(Held& held, const ContactPose& pose, const JointVector& torque_Nm,
                        const Eigen::Matrix3d& covariance_Nm2) const noexcept {
  ContactAnswer& answer = held.answer;
  const auto solved = solve(pose, torque_Nm, covariance_Nm2, held.back ? 1 : kComeBackStrictness);
  const auto* const refusal = std::get_if<ContactRefusal>(&solved);
  held.answered_s = refusal ? 0 : held.answered_s + step_s_;
  if (refusal) {
    held.back = false;
    answer.refusal = *refusal;
  } else if (held.back || held.answered_s >= kComeBack_s) {
    held.back = true;
    answer.refusal.reset();
  }
  if (!refusal && (held.back || answer.share == 0)) {
    const Found& found = std::get<Found>(solved);
    answer.load = found.load;
    answer.sigma_N = found.sigma_N;
  }
  const double change = step_s_ / kFade_s;
  answer.share = std::clamp(answer.share + (held.back ? change : -change), 0.0, 1.0);
  if (!held.started) answer.share = held.back ? 1 : 0;
  held.started = true;
}

}  // namespace knuckle::estimation
