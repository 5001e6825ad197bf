// Three answers to "what acts on the bucket?" beside the default (tip_force.h), from the same external joint torques
// and their covariance. Pure functions of one pose; what cannot be known from that pose is refused with the reason.
//   tip_wrench                Fx, Fz and a torque about the tip from three joints (Kim et al.: matrix inversion)
//   tip_force_of_two          Fx, Fz at a given point of the bucket from arm and bucket joint alone, and
//   force_and_position        size and place along the bucket of a force of known direction, likewise (both Malaguti
//                             and Zaghi: "force/force-direction", "force/force-position")
// The last two do not use the boom's torque: they need no sensor of its cylinder, and a load on the boom does not
// change them.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <variant>

#include "core/joints.h"

namespace knuckle::estimation {

enum class ContactRefusal : std::uint8_t {
  kStraightArm,         ///< Boom and arm in line: no joint feels a force along them apart from the torque.
  kBucketInLine,        ///< Arm and bucket in line, likewise.
  kNearToggle,          ///< The bucket's lever is about nothing: neither angle nor torque is known there.
  kDirectionAlongLink,  ///< A force of this direction passes through the joint.
  kForceTooSmall,       ///< A place needs a force that is larger than its uncertainty.
  kOffTheBucket,        ///< The place is not on the bucket: the direction or the model does not fit.
  kNoDirection,         ///< The direction is that of a motion, and nothing has moved yet.
  kNotFinite,
};

/// What every model starts from. Torques are of the world on the joints.
struct JointLoad {
  JointVector joint_rad = JointVector::Zero();  ///< Relative angles; boom from M's x axis.
  JointVector lever_m = JointVector::Zero();    ///< dL/dtheta of the cylinders.
  JointVector torque_Nm = JointVector::Zero();
  Eigen::Matrix3d covariance_Nm2 = Eigen::Matrix3d::Zero();
};

struct TipWrench {
  Eigen::Vector3d wrench;      ///< Fx [N], Fz [N] in M, torque about the tip [N m], of the world on the bucket.
  Eigen::Matrix3d covariance;  ///< Likewise.
};
struct TwoJointForce {
  PlanarVector force_N;  ///< Frame M.
  Eigen::Matrix2d covariance_N2;
};
struct ForceAtPlace {
  double force_N = 0;                                    ///< Along the given direction.
  double place_m = 0;                                    ///< From the bucket joint along the bucket's x axis.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Of (force, place).
};
template <typename T>
using OrRefusal = std::variant<T, ContactRefusal>;

inline constexpr double kLeastSine = 0.1;      ///< Of the angle between two links.
inline constexpr double kLeastSigmas = 3;      ///< Of the force, before its place is told.
inline constexpr double kLeastPlace = 0.25;    ///< Of the bucket's length: nearer to its joint no force is found.
inline constexpr double kBesideBucket = 0.25;  ///< Of its length: a place this far off its ends is let pass.

/// Solves J' w = torque for all three unknowns; the determinant is l_boom l_arm sin(theta_arm).
/// @param length_m of the three links. @param strictness times the least sines and levers that are taken.
[[nodiscard]] OrRefusal<TipWrench> tip_wrench(const JointVector& length_m, const JointLoad& load,
                                              double strictness = 1) noexcept;

/// Force and its direction from the arm's and the bucket's torque; it acts at place_m along the bucket's x axis.
/// (tau_arm - tau_bucket) / l_arm = n_arm . F and tau_bucket / place = n_bucket . F, n normal to the link.
[[nodiscard]] OrRefusal<TwoJointForce> tip_force_of_two(const JointVector& length_m, const JointLoad& load,
                                                        double place_m, double strictness = 1) noexcept;

/// Size and place of a force of known direction (frame M; any length but zero) from the same two equations.
[[nodiscard]] OrRefusal<ForceAtPlace> force_and_position(const JointVector& length_m, const JointLoad& load,
                                                         const PlanarVector& direction, double strictness = 1) noexcept;

/// Its size alone, which does not hang on its place: from how large it is too small to have one does not matter.
struct ForceAlong {
  double force_N, variance_N2;
};
[[nodiscard]] OrRefusal<ForceAlong> force_along(const JointVector& length_m, const JointLoad& load,
                                                const PlanarVector& direction, double strictness = 1) noexcept;

}  // namespace knuckle::estimation
