// Contact model `tip_force`: one force at the bucket tip, from the joint torques that are known (torque_weight.h), by
// covariance-weighted least squares; what is left over of three tells whether one tip force explains them.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <utility>

#include "core/joints.h"
#include "estimation/torque_weight.h"
#include "machine/description_fwd.h"
#include "machine/planar_jacobian.h"

namespace knuckle::estimation {

struct TipForce {
  PlanarVector force_N;  ///< Frame M, of the world on the tip.
  Eigen::Matrix2d covariance_N2;
  double residual_sigma;  ///< sqrt of the weighted residual: chi with one degree of freedom.
};

/// Largest standard deviation in any direction.
[[nodiscard]] inline double largest_sigma(const Eigen::Matrix2d& c) noexcept {
  const double mean = 0.5 * (c(0, 0) + c(1, 1));
  return std::sqrt(mean + std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1)));
}

/// Larger forces than this are not believed: keeps the answer finite where the arm is straight.
inline constexpr double kForcePrior_N = 2e4;
/// The same of two torques, which in poses through a whole dig tell one direction hardly: as much as a machine presses.
inline constexpr double kForcePriorOfTwo_N = 5e3;

/// Inverse of the covariance of the torques that are known; zero for the others.
[[nodiscard]] Eigen::Matrix3d torque_weight(const Eigen::Matrix3d& covariance_Nm2) noexcept;

/// Solves J^T f = torque in the least-squares sense with weights covariance^-1.
/// @param jacobian d tip / d joints in M; @param covariance_Nm2 of the torques, positive definite where they are known.
[[nodiscard]] TipForce solve_tip_force(const PlanarJacobian& jacobian, const JointVector& torque_Nm,
                                       const Eigen::Matrix3d& covariance_Nm2) noexcept;

// Contact model `bucket_force`: one force anywhere on the bucket, from the joint torques. A force off the tip is the
// same force at the tip and a couple, which turns all three joints alike. How large the couple may be, the bucket's
// outline says, and mostly which of its corners it is that touches. Where a torque is missing nothing of the couple is
// seen; then the outline alone says what it may be, and the force is the less sure.

/// What acts on the bucket, of the world on it: a force as if at the tip, frame M, and a torque about the tip.
struct BucketLoad {
  PlanarVector force_N = PlanarVector::Zero();
  Eigen::Matrix2d covariance_N2 = Eigen::Matrix2d::Zero();
  double torque_Nm = 0, torque_variance_N2m2 = 0;
  PlanarVector covariance_N2m = PlanarVector::Zero();  ///< Of force and torque.
  double residual_sigma = 0;  ///< How far the couple lies beyond what the outline allows, in standard deviations.
};

class BucketForceModel {
 public:
  explicit BucketForceModel(const MachineDescription& machine) noexcept;

  /// Weighs one answer for each corner of the outline, as if that touched, and one for anywhere on it (Bayesian model
  /// averaging). What counts: how well a force at that place explains the torques, and whether it could push there.
  /// A surface pushes on a corner along its own normal, within friction, and on a convex outline a corner has only
  /// normals between those of its two sides. The covariance includes how far the answers are apart.
  /// @param jacobian d tip / d joints in M; @param covariance_Nm2 of the torques, positive definite where known.
  [[nodiscard]] BucketLoad solve(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                 const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept;

  /// The force at the tip that explains the torques best; its covariance includes that it may act elsewhere on the
  /// outline. With arm and bucket torque alone the force is tip_force_of_two() at the tip.
  [[nodiscard]] BucketLoad at_tip(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                  const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept;

  /// Couple of the force about the tip, from the answer for anywhere alone: for what must not jump where in an impact
  /// the weights of the corners change. 0 where a torque is missing.
  [[nodiscard]] double couple_Nm(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                 const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept;

 private:
  struct Corner {
    PlanarVector from_tip_m = PlanarVector::Zero();  ///< Bucket axes.
    double normal_rad = 0, spread_rad = 0;           ///< Outward normals, from the bucket's x axis: middle, half range.
    double share = 0;                                ///< Of touches.
  };
  /// One answer and the logarithm of its weight.
  struct Answer {
    BucketLoad load;
    double log_weight = 0;
  };
  struct AnyPlace {
    Answer answer;
    double couple_Nm = 0;  ///< About the tip.
  };
  struct Torques {
    Eigen::Rotation2Dd to_machine;
    const PlanarJacobian& jacobian;
    const JointVector& torque_Nm;
    const Eigen::Matrix3d& covariance_Nm2;
    bool all_known;
  };
  static constexpr std::size_t kCorners = 6;  ///< As bucket_outline() has them.
  /// The answer for anywhere and, where the bucket has an outline, that of each corner.
  struct Answers {
    std::array<Answer, kCorners + 1> all;
    std::size_t count = 0;
    [[nodiscard]] BucketLoad mean() const noexcept;
  };
  [[nodiscard]] Torques torques(const JointVector& joints_rad, const PlanarJacobian& jacobian,
                                const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept;
  [[nodiscard]] Answer at(const Corner& corner, const Torques& torques) const noexcept;
  [[nodiscard]] AnyPlace anywhere(const Torques& torques) const noexcept;
  [[nodiscard]] Answers answers(const Torques& torques) const noexcept;
  [[nodiscard]] std::pair<double, double> couples_Nm(const Eigen::Rotation2Dd& to_machine,
                                                     const PlanarVector& force_N) const noexcept;
  void add_torque(const Torques& torques, BucketLoad& load) const noexcept;

  std::array<Corner, kCorners> corners_{};
  Corner middle_;  ///< Of the outline.
  bool outlined_ = false;
};

}  // namespace knuckle::estimation
