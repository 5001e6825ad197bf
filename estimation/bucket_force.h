// Contact model `bucket_force`: one force anywhere on the bucket, from three joint torques. A force off the tip is the
// same force at the tip and a couple, which turns all three joints alike; how large the couple may be, the bucket's
// outline says.
#pragma once

#include <Eigen/Dense>
#include <array>

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

struct BucketForce {
  PlanarVector force_N;  ///< Frame M, of the world on the bucket.
  Eigen::Matrix2d covariance_N2;
  double couple_Nm = 0;       ///< Of the force about the tip.
  double residual_sigma = 0;  ///< How far the couple lies beyond what the outline allows, in standard deviations.
};

class BucketForceModel {
 public:
  explicit BucketForceModel(const MachineDescription& machine) noexcept;

  /// Solves J^T f + u c = torque, u = (1, 1, 1), with weights covariance^-1 and a prior of c around zero whose variance
  /// is what the torques show of it (empirical Bayes), within the couples that f can have on the outline. Where a force
  /// at the tip explains the torques the answer is that force; c costs no accuracy there.
  /// @param jacobian d tip / d joints in M; @param covariance_Nm2 of the torques, positive definite.
  [[nodiscard]] BucketForce solve(const JointVector& joints_rad, const Eigen::Matrix<double, 2, 3>& jacobian,
                                  const JointVector& torque_Nm, const Eigen::Matrix3d& covariance_Nm2) const noexcept;

 private:
  std::array<PlanarVector, 5> from_tip_m_;  ///< The outline's other corners, bucket axes.
};

}  // namespace knuckle::estimation
