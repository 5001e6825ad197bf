// Contact model `bucket_force`: one force anywhere on the bucket, from three joint torques. A force off the tip is the
// same force at the tip and a couple, which turns all three joints alike. How large the couple may be, the bucket's
// outline says, and mostly which of its corners it is that touches.
#pragma once

#include <Eigen/Dense>
#include <array>

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

struct BucketForce {
  PlanarVector force_N;  ///< Frame M, of the world on the bucket.
  Eigen::Matrix2d covariance_N2;
  double residual_sigma = 0;  ///< How far the couple lies beyond what the outline allows, in standard deviations.
};

class BucketForceModel {
 public:
  explicit BucketForceModel(const MachineDescription& machine) noexcept;

  /// Weighs one answer for each corner of the outline, as if that touched, and one for anywhere on it (Bayesian model
  /// averaging). What counts: how well a force at that place explains the torques, and whether it could push there.
  /// A surface pushes on a corner along its own normal, within friction, and on a convex outline a corner has only
  /// normals between those of its two sides. The covariance includes how far the answers are apart.
  /// @param jacobian d tip / d joints in M; @param covariance_Nm2 of the torques, positive definite.
  [[nodiscard]] BucketForce solve(const JointVector& joints_rad, const Eigen::Matrix<double, 2, 3>& jacobian,
                                  const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept;

  /// Couple of the force about the tip, from the answer for anywhere alone: for what must not jump where in an impact
  /// the weights of the corners change.
  [[nodiscard]] double couple_Nm(const JointVector& joints_rad, const Eigen::Matrix<double, 2, 3>& jacobian,
                                 const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept;

 private:
  struct Corner {
    PlanarVector from_tip_m = PlanarVector::Zero();  ///< Bucket axes.
    double normal_rad = 0, spread_rad = 0;           ///< Outward normals, from the bucket's x axis: middle, half range.
    double share = 0;                                ///< Of touches.
  };
  /// One answer and the logarithm of its weight.
  struct Answer {
    PlanarVector force_N = PlanarVector::Zero();
    Eigen::Matrix2d covariance_N2 = Eigen::Matrix2d::Zero();
    double log_weight = 0;
  };
  struct AnyPlace {
    Answer answer;
    double couple_Nm = 0;       ///< About the tip.
    double residual_sigma = 0;  ///< As that of BucketForce.
  };
  struct Torques {
    Eigen::Rotation2Dd to_machine;
    const Eigen::Matrix<double, 2, 3>& jacobian;
    const JointVector& torque_Nm;
    const Eigen::Matrix3d& covariance_Nm2;
  };
  [[nodiscard]] Answer at(const Corner& corner, const Torques& torques) const noexcept;
  [[nodiscard]] AnyPlace anywhere(const Torques& torques) const noexcept;

  static constexpr std::size_t kCorners = 6;  ///< As bucket_outline() has them.
  std::array<Corner, kCorners> corners_{};
  bool outlined_ = false;
};

}  // namespace knuckle::estimation
