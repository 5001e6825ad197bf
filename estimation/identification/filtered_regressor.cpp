#include "estimation/identification/filtered_regressor.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "core/symmetric_eigen.h"
#include "estimation/friction.h"
#include "estimation/identification/smoothing.h"
#include "estimation/observer.h"

namespace knuckle::estimation {
namespace {

constexpr Eigen::Index kBaseRows = kJoints * kBaseParameters, kFrictionRows = kJoints * kFrictionCount;
/// Friction of a rod slower than this is not trusted: it may be anything up to breakaway.
constexpr double kSlow_mps = 2e-3;

using Momentum = Eigen::Array<double, kBaseRows, 1>;
/// Everything that goes through F as it is: velocity products and gravity, friction, right side, trust.
constexpr Eigen::Index kRight = kBaseRows + kFrictionRows, kTrust = kRight + kJoints, kPlainRows = kTrust + kJoints;
using Plain = Eigen::Array<double, kPlainRows, 1>;

/// Rows Q (absolute angles) to rows tau (relative joints), laid out row by row.
Momentum joint_rows(const Regressor& absolute_rows) noexcept {
  Eigen::Matrix<double, kJoints, kBaseParameters, Eigen::RowMajor> rows = absolute_rows;
  for (int i = kJoints - 2; i >= 0; --i) rows.row(i) += rows.row(i + 1);
  return Eigen::Map<const Momentum>(rows.data());
}

/// Unfiltered signals of one sample.
struct Sample {
  Sample(const RigidArm& arm, const Motion& motion, const FrictionSignals& friction, Eigen::Index n) {
    const Pose pose(motion.joint_rad.col(n), motion.hull_pitch_rad[n]);
    const JointVector rate = absolute(motion.joint_radps.col(n));
    momentum = joint_rows(arm.momentum(pose, rate));
    plain.head<kBaseRows>() = joint_rows(arm.velocity_products(pose, rate) + RigidArm::gravity(pose));
    for (int j = 0; j < kJoints; ++j) {
      const double lever = motion.lever_m(j, n), speed = std::abs(motion.cylinder_mps(j, n)) / kSlow_mps;
      plain.segment<kFrictionCount>(kBaseRows + kFrictionCount * j) =
          lever * friction.columns.col(n).segment<kFrictionCount>(kFrictionCount * j).array();
      plain[kRight + j] = lever * motion.cylinder_N(j, n);
      plain[kTrust + j] = friction.known(j, n) * std::min(1.0, speed * speed);
    }
  }
  Momentum momentum;
  Plain plain;
};

}  // namespace

FrictionSignals friction_signals(const Motion& motion, const FrictionColumns& options) {
  FrictionSignals signals;
  signals.columns = Eigen::MatrixXd::Zero(kFrictionRows, motion.size());
  signals.known = Eigen::Matrix3Xd::Zero(kJoints, motion.size());
  for (const Stretch& stretch : motion.stretches) {
    for (int j = 0; j < kJoints; ++j) {
      DahlState dahl;
      double unknown = 1;
      for (Eigen::Index n = stretch.first; n < stretch.end; ++n) {
        const double v = motion.cylinder_mps(j, n), slip = v / options.stribeck_mps;
        double turned = dahl.step(v, motion.step_s);
        if (options.settle) turned = dahl.settle(v, motion.step_s);
        unknown *= std::exp(-std::abs(v) * motion.step_s / DahlState::kTurnDistance_m);
        const double s = options.dahl ? turned : (v >= 0 ? 1.0 : -1.0);
        auto column = signals.columns.col(n).segment<kFrictionCount>(kFrictionCount * j);
        column[kCoulombExtend] = (1 + s) / 2;
        column[kCoulombRetract] = (s - 1) / 2;
        column[kViscous] = v;
        if (options.stribeck) column[kBreakaway] = s * std::exp(-slip * slip);
        if (options.load) column[kLoadShare] = s * std::abs(motion.smooth_cylinder_N(j, n));
        if (options.seal) column[kSeal] = s * std::max(0.0, motion.smooth_pressure_sum_Pa(j, n));
        signals.known(j, n) = options.dahl ? 1 - unknown : 1;
      }
    }
  }
  return signals;
}

FilteredRegressor filtered_regressor(const RigidArm& arm, const Motion& motion, const RegressorOptions& options) {
  const double gain = 2 * std::numbers::pi * options.pole_Hz;
  const FrictionSignals friction = friction_signals(motion, options.friction);
  Eigen::MatrixXd all = Eigen::MatrixXd::Constant(kPlainRows, motion.size(), std::numeric_limits<double>::quiet_NaN());
  for (const Stretch& stretch : motion.stretches) {
    FohFilter<Momentum> momentum(options.pole_Hz, motion.step_s);
    FohFilter<Plain> plain(options.pole_Hz, motion.step_s);
    for (Eigen::Index n = stretch.first; n < stretch.end; ++n) {
      const Sample sample(arm, motion, friction, n);
      // From P(0) instead of 0: that is the term a e^{-at} P(0). All the rest starts at 0 on both sides alike.
      if (n == stretch.first) {
        momentum.reset(sample.momentum);
        plain.start(sample.plain);
      } else {
        momentum.step(sample.momentum);
        plain.step(sample.plain);
      }
      all.col(n) = plain.value();
      all.col(n).head<kBaseRows>().array() += gain * (sample.momentum - momentum.value());
    }
  }
  FilteredRegressor result;
  result.step_s = motion.step_s;
  result.stretches = motion.stretches;
  if (options.triangle_s > 0) {
    const int half = half_window(options.triangle_s, motion.step_s);
    for (int pass = 0; pass < 2; ++pass) {
      all = box_filtered(all, half, result.stretches);
      result.stretches = shortened(result.stretches, half);
    }
  }
  result.base = all.topRows(kBaseRows);
  result.friction = all.middleRows(kBaseRows, kFrictionRows);
  result.right = all.middleRows(kRight, kJoints);
  result.trust = all.middleRows(kTrust, kJoints);
  return result;
}

BaseParameters project(const MachineDescription& machine, const std::vector<DynamicState>& samples) {
  using Matrix = Eigen::Matrix<double, kBaseParameters, kBaseParameters>;
  const RigidArm arm(machine);
  Matrix information = Matrix::Zero();
  BaseParameters right = BaseParameters::Zero();
  for (const DynamicState& s : samples) {
    Regressor rows =
        arm.inverse_dynamics(Pose(s.joint_rad, s.hull_pitch_rad), absolute(s.joint_radps), absolute(s.joint_radps2));
    for (int i = kJoints - 2; i >= 0; --i) rows.row(i) += rows.row(i + 1);
    for (int i = 0; i < kJoints; ++i) {
      const double weight = lever_weight(s.lever_m[i]);
      information += weight * weight * rows.row(i).transpose() * rows.row(i);
      right += weight * weight * s.joint_Nm[i] * rows.row(i).transpose();
    }
  }
  const BaseParameters scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * information * scale.asDiagonal());
  if (!(eigen.values[0] > 1e-10 * eigen.values[kBaseParameters - 1]))
    throw std::invalid_argument("projection: the samples do not determine all nine base parameters");
  const BaseParameters along = eigen.vectors.transpose() * scale.cwiseProduct(right);
  return scale.cwiseProduct(eigen.vectors * along.cwiseQuotient(eigen.values));
}

}  // namespace knuckle::estimation
