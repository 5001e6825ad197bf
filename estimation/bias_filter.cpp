#include "estimation/bias_filter.h"

#include <algorithm>
#include <cmath>

#include "estimation/regressor.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

// At the tip of a stretched arm of kReach_m.
constexpr PerJoint<double> kBending_m_per_N{1.5e-6, 1e-6, 0.5e-6};
constexpr double kGround_m_per_N = 2e-6, kReach_m = 3.2;

}  // namespace

JointVector usual_compliance_radpNm(const MachineDescription& machine) {
  double out_m = 0;  // joint to tip
  JointVector compliance;
  for (int i = kJoints - 1; i >= 0; --i) {
    out_m += machine.links[static_cast<std::size_t>(i)].length_m;
    compliance[i] =
        (kBending_m_per_N[static_cast<std::size_t>(i)] + (i == kBoom ? kGround_m_per_N : 0)) / (out_m * out_m);
  }
  return compliance * (kReach_m / out_m);
}

void TorqueRate::reset(const JointVector& cylinder_Nm) noexcept {
  torque_.reset(cylinder_Nm);
  late_rate_Nmps_.setZero();
  shaken_Nmps2_.setZero();
}

void TorqueRate::step(const JointVector& cylinder_Nm) noexcept {
  const JointVector before_Nmps = late_rate_Nmps_;
  late_rate_Nmps_ = gain_ * (cylinder_Nm - torque_.step(cylinder_Nm));
  shaken_Nmps2_ = (late_rate_Nmps_ - before_Nmps) / step_s_;
}

UnseenColumns TorqueRate::columns(const Eigen::Matrix3d& inertia_kgm2) const noexcept {
  UnseenColumns columns;
  columns << -inertia_kgm2 * shaken_Nmps2_.asDiagonal(), -late_rate_Nmps_;
  return columns;
}

BiasColumns BiasSignals::columns() const noexcept {
  BiasColumns h = BiasColumns::Zero();
  for (int i = 0; i < kJoints; ++i) {
    h(i, kBiasOffset + i) = lever[i];
    h(i, kBiasCoulomb + i) = lever_dahl[i];
    h(i, kBiasViscous + i) = lever_speed[i];
    h(i, kBiasSeal + i) = lever_dahl_pressure[i];
    for (int k = i; k < kJoints; ++k) {
      h(i, kBiasMomentX + k) = gravity_x[k];
      h(i, kBiasMomentZ + k) = gravity_z[k];
    }
  }
  h.rightCols<kBiasUnseen>() = unseen;
  return h;
}

// Priors and the sequential update of the bias filter.

namespace {

// What may be wrong with a machine as drawn (standard deviations).
constexpr double kPressureOffset_Pa = 0.6e5;  // +-1 bar, evenly spread
constexpr double kCoulombPart = 0.2;          // +-30 %, evenly spread
constexpr double kViscousPart = 0.25;         // friction +-30 % and the oil's temperature
constexpr double kSealPart = 0.02;            // of piston area times pressure: 0.5 to 2 % new, more where worn
constexpr double kMassPart = 0.04;            // +-5 %, and what sits on the links that no drawing shows
constexpr double kComPart = 0.02;             // of the link length
// What another day changes of a calibrated one. 0.1 bar per transmitter is 40 N at the boom of the 1.5 t class. Oil
// that is 20 degrees warmer or colder is the largest error of all: 8 of 20 kN s/m.
constexpr double kDailyOffset_Pa = 0.1e5;
constexpr double kDailyCoulombPart = 0.05;
constexpr double kDailyViscousPart = 0.4;
constexpr double kDailyDirt_kg = 1;  // of soil that sticks to the bucket, a third of it on the arm
// Drift while running: seals and oil warm up, transmitters creep.
constexpr double kBiasWalk_N = 1.0;          // per square root of a second
constexpr double kFrictionWalkPart = 0.002;  // likewise
// What yields between encoder and link. One value per joint is not exact: levers change with the pose and pins have
// play.
constexpr double kBendingLeastPart = 0.25, kBendingWalkPart = 0.01;
// Transmitters of machines answer within 2 to 8 ms. One constant is an approximation: they are not exactly first-order,
// and the six differ.
constexpr double kLagSpread_s = 3e-3, kLagLeast_s = 0.5e-3, kLagWalk_s = 0.05e-3;
constexpr double kMostLag_s = 15e-3;  // nor below 0: pressures do not come before the force

double mean_area_m2(const CylinderDescription& cylinder) {
  return 0.5 * (cylinder.head_area_m2() + cylinder.rod_side_area_m2());
}

double offset_N(const CylinderDescription& cylinder, double pressure_Pa) {
  return pressure_Pa * std::hypot(cylinder.head_area_m2(), cylinder.rod_side_area_m2());
}

/// Covariance of the moments for 1 kg more or less at a place of one link: it moves that link's own moments and, at
/// their full length, the earlier links', all together.
BiasMatrix of_mass(const MachineDescription& machine, int link, const PlanarVector& at_m) {
  BiasVector per_mass = BiasVector::Zero();
  for (int i = 0; i < link; ++i) per_mass[kBiasMomentX + i] = machine.links[static_cast<std::size_t>(i)].length_m;
  per_mass[kBiasMomentX + link] = at_m.x();
  per_mass[kBiasMomentZ + link] = at_m.y();
  return per_mass * per_mass.transpose();
}

}  // namespace

BiasFilter::BiasFilter(const MachineDescription& machine) {
  if (machine.dynamics_calibration) {
    expect_calibrated(machine, *machine.dynamics_calibration);
  } else {
    expect_drawing(machine);
  }
  expect_bending(machine);
  expect_lag();
  for (int i = 0; i < kJoints; ++i) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    const FrictionDescription& friction = cylinder.friction;
    walk_[kBiasOffset + i] = kBiasWalk_N * kBiasWalk_N;
    walk_[kBiasCoulomb + i] = std::pow(kFrictionWalkPart * friction.coulomb_N, 2);
    walk_[kBiasViscous + i] = std::pow(kFrictionWalkPart * friction.viscous_Ns_per_m, 2);
    walk_[kBiasSeal + i] = std::pow(kFrictionWalkPart * kSealPart * mean_area_m2(cylinder), 2);
  }
  prior_ = p_.diagonal();
}

void BiasFilter::expect_drawing(const MachineDescription& machine) {
  for (int i = 0; i < kJoints; ++i) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    p_(kBiasOffset + i, kBiasOffset + i) = std::pow(offset_N(cylinder, kPressureOffset_Pa), 2);
    p_(kBiasCoulomb + i, kBiasCoulomb + i) = std::pow(kCoulombPart * cylinder.friction.coulomb_N, 2);
    p_(kBiasViscous + i, kBiasViscous + i) = std::pow(kViscousPart * cylinder.friction.viscous_Ns_per_m, 2);
    p_(kBiasSeal + i, kBiasSeal + i) = std::pow(kSealPart * mean_area_m2(cylinder), 2);
  }
  for (int k = 0; k < kJoints; ++k) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(k)];
    p_ += std::pow(kMassPart * link.mass_kg, 2) * of_mass(machine, k, link.com_m);
    const double com = std::pow(kComPart * link.length_m * link.mass_kg, 2);
    p_(kBiasMomentX + k, kBiasMomentX + k) += com;
    p_(kBiasMomentZ + k, kBiasMomentZ + k) += com;
  }
}

/// The same for calibrated machines: identification does not find it.
void BiasFilter::expect_bending(const MachineDescription& machine) {
  const JointVector compliance = usual_compliance_radpNm(machine);
  for (int i = 0; i < kJoints; ++i) {
    p_(kBiasBending + i, kBiasBending + i) = std::pow(compliance[i], 2);
    least_[kBiasBending + i] = std::pow(kBendingLeastPart * compliance[i], 2);
    walk_[kBiasBending + i] = std::pow(kBendingWalkPart * compliance[i], 2);
  }
}

void BiasFilter::expect_lag() {
  x_[kBiasLag] = kUsualLag_s;
  p_(kBiasLag, kBiasLag) = kLagSpread_s * kLagSpread_s;
  least_[kBiasLag] = kLagLeast_s * kLagLeast_s;
  walk_[kBiasLag] = kLagWalk_s * kLagWalk_s;
}

/// Covariance of the identified parameters, carried over to the corrections; and what a day changes. Inertias,
/// breakaway and load share have no correction: what they have wrong stays in the residual of free motion.
void BiasFilter::expect_calibrated(const MachineDescription& machine, const DynamicsCalibration& found) {
  Eigen::Matrix<double, kBiasStates, kCalibrationCount> map = decltype(map)::Zero();
  for (int i = 0; i < kJoints; ++i) {
    map(kBiasMomentX + i, kMomentX + i) = map(kBiasMomentZ + i, kMomentZ + i) = 1;
    map(kBiasOffset + i, friction_index(i, kCoulombExtend)) = map(kBiasCoulomb + i, friction_index(i, kCoulombExtend)) =
        map(kBiasCoulomb + i, friction_index(i, kCoulombRetract)) = 0.5;
    map(kBiasOffset + i, friction_index(i, kCoulombRetract)) = -0.5;
    map(kBiasViscous + i, friction_index(i, kViscous)) = 1;
    map(kBiasSeal + i, friction_index(i, kSeal)) = 1;
  }
  p_ = map * found.covariance * map.transpose();
  for (int i = 0; i < kJoints; ++i) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    const FrictionCalibration friction = found.friction(i);
    const double coulomb = 0.5 * (friction.coulomb_extend_N + friction.coulomb_retract_N);
    p_(kBiasOffset + i, kBiasOffset + i) += std::pow(offset_N(cylinder, kDailyOffset_Pa), 2);
    p_(kBiasCoulomb + i, kBiasCoulomb + i) += std::pow(kDailyCoulombPart * coulomb, 2);
    p_(kBiasViscous + i, kBiasViscous + i) += std::pow(kDailyViscousPart * friction.viscous_Ns_per_m, 2);
    const bool seal_known = found.covariance(friction_index(i, kSeal), friction_index(i, kSeal)) > 0;
    p_(kBiasSeal + i, kBiasSeal + i) +=
        std::pow(seal_known ? kDailyCoulombPart * friction.seal_m2 : kSealPart * mean_area_m2(cylinder), 2);
  }
  p_ += kDailyDirt_kg * kDailyDirt_kg * of_mass(machine, kBucket, machine.links[kBucket].com_m);
  p_ += kDailyDirt_kg * kDailyDirt_kg / 9 * of_mass(machine, kArm, machine.links[kArm].com_m);
}

void BiasFilter::predict(double duration_s) noexcept {
  for (int i = 0; i < kBiasStates; ++i)
    if (p_(i, i) < prior_[i]) p_(i, i) = std::max(least_[i], p_(i, i) + walk_[i] * duration_s);
}

void BiasFilter::update(const BiasSample& sample) noexcept {
  if (queued_ == kDelayedUpdates) {
    learn(queue_[static_cast<std::size_t>(next_)]);
  } else {
    ++queued_;
  }
  queue_[static_cast<std::size_t>(next_)] = sample;
  next_ = (next_ + 1) % kDelayedUpdates;
}

void BiasFilter::learn(const BiasSample& sample) noexcept {
  predict(kUpdateEvery_s);
  const BiasColumns h = sample.signals.columns();
  last_nis_ = 0;
  // A torque that is not known has no weight here: its variance is infinite.
  const auto known = static_cast<double>(sample.variance_Nm2.array().isFinite().count());
  for (int i = 0; i < kJoints; ++i) {
    const BiasVector row = h.row(i).transpose();
    const BiasVector ph = p_ * row;
    const double spread = row.dot(ph);
    const double innovation = -sample.residual_Nm[i] - row.dot(x_);
    last_nis_ += innovation * innovation / (spread + sample.variance_Nm2[i]) / known;
    // Huber: beyond 2.5 sigma an innovation counts only as much as 2.5 sigma would.
    const double inexact = row.cwiseAbs2().dot(least_);  // of corrections that are not constant
    const double repeated = kRepeats * (sample.variance_Nm2[i] + inexact);
    const double ratio = std::abs(innovation) / (2.5 * std::sqrt(spread + repeated));
    const double variance = repeated * std::max(1.0, ratio);
    const BiasVector gain = ph / (spread + variance);
    x_ += gain * innovation;
    p_ -= gain * ph.transpose();
  }
  x_[kBiasLag] = std::clamp(x_[kBiasLag], 0.0, kMostLag_s);
  p_ = 0.5 * (p_ + p_.transpose()).eval();
  if (learned_s_ == 0) mean_nis_ = last_nis_;
  mean_nis_ += kUpdateEvery_s / std::min(kNisMemory_s, learned_s_ + kUpdateEvery_s) * (last_nis_ - mean_nis_);
  learned_s_ += kUpdateEvery_s;
}

}  // namespace knuckle::estimation
