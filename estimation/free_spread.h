// How wrong the estimator is when nothing touches the machine, learned while nothing does.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/joints.h"

namespace knuckle::estimation {

/// Covariance of the joint torques less their bias in free motion of one speed class, less what the bias filter's own
/// covariance accounts for already: adding that to it gives the whole. Kept as running moments of the last kMemory_s of
/// updates; before the first updates a prior stands for them and counts as many as kPriorUpdates. Never below a tenth
/// of the prior's spread: a quiet minute makes no perfect estimator.
class FreeSpread {
 public:
  static constexpr double kMemory_s = 60;
  static constexpr double kPriorUpdates = 20;
  static constexpr double kSmallestPart = 0.1;      ///< Of the prior's spread.
  static constexpr double kLeastUnexplained = 0.5;  ///< Of the variance seen, whatever the bias filter says.

  FreeSpread(const JointVector& prior_variance_Nm2, double look_every_s) noexcept
      : floor_Nm2_(kSmallestPart * kSmallestPart * prior_variance_Nm2),
        moment_Nm2_(prior_variance_Nm2.asDiagonal()),
        most_updates_(kMemory_s / look_every_s) {
    solve();
  }

  /// @param explained_Nm2 variances that the bias filter's covariance gave this update.
  void update(const JointVector& torque_Nm, const JointVector& explained_Nm2) noexcept {
    updates_ = std::min(updates_ + 1, most_updates_);
    moment_Nm2_ += (torque_Nm * torque_Nm.transpose() - moment_Nm2_) / updates_;
    explained_Nm2_ += (explained_Nm2 - explained_Nm2_) / updates_;
    solve();
  }
  [[nodiscard]] const Eigen::Matrix3d& covariance_Nm2() const noexcept { return covariance_Nm2_; }

 private:
  /// Variances are reduced, correlations stay: so the matrix stays positive definite.
  void solve() noexcept {
    JointVector part;
    for (int i = 0; i < kJoints; ++i) {
      const double seen = moment_Nm2_(i, i);
      const double left = std::max(seen - explained_Nm2_[i], kLeastUnexplained * seen);
      part[i] = std::sqrt(left / seen);
    }
    covariance_Nm2_ = part.asDiagonal() * moment_Nm2_ * part.asDiagonal();
    covariance_Nm2_.diagonal() = covariance_Nm2_.diagonal().cwiseMax(floor_Nm2_);
  }

  JointVector floor_Nm2_;
  Eigen::Matrix3d moment_Nm2_;
  JointVector explained_Nm2_ = JointVector::Zero();
  double updates_ = kPriorUpdates, most_updates_;
  Eigen::Matrix3d covariance_Nm2_;
};

}  // namespace knuckle::estimation
