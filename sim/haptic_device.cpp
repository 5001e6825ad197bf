#include "sim/haptic_device.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/seed.h"
#include "core/units.h"

namespace knuckle::sim {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

}  // namespace

DeviceTruth sample_device(const DeviceDescription& nominal, Family family, std::uint64_t seed) {
  DeviceTruth truth(nominal);
  if (family == Family::kSmooth) return truth;
  const bool worn = family == Family::kWorn;
  std::mt19937_64 random(stream_seed(seed, Stream::kDevice));
  const auto within = [&random](double bound) { return bound * (2 * unit_interval(random) - 1); };
  for (std::size_t i = 0; i < kJoints; ++i) {
    truth.built.torque_constant_Nm_per_A[i] *= 1 + within(worn ? 0.1 : 0.03);
    const double counts_per_rad = nominal.gear_ratio[i] * nominal.counts_per_turn[i] / kTurn;
    truth.built.zero_counts[i] +=
        static_cast<std::int32_t>(std::lround(counts_per_rad * within((worn ? 0.5 : 0.1) * kDegree)));
    if (!worn) continue;
    truth.built.friction_Nm[i] *= std::pow(5, unit_interval(random));
    truth.built.cogging_Nm[i] *= 1 + 2 * unit_interval(random);
    truth.backlash_rad[static_cast<Eigen::Index>(i)] = 0.3 * kDegree * unit_interval(random);
  }
  return truth;
}

// The haptic device and the limb that holds it: dynamics and motors.

namespace {

constexpr int kSubsteps = 4;
constexpr double kFirmwareTick_s = 1e-3;
constexpr double kDt_s = kFirmwareTick_s / kSubsteps;
constexpr double kCurrentLag_s = 0.3e-3;                   // closed current loop of the motor stage
constexpr double kBristle_rad = 3e-4;                      // pre-sliding range of gear friction
constexpr double kStop_Nm_per_rad = 40, kStop_Nms = 0.05;  // rubber end stops

LimbImpedance scaled_by_grip(LimbImpedance limb, double grip) noexcept {
  limb.mass_kg *= grip;
  limb.damping_Ns_per_m *= grip;
  limb.stiffness_N_per_m *= grip;
  limb.wrist_inertia_kgm2 *= grip;
  limb.wrist_damping_Nms *= grip;
  limb.wrist_stiffness_Nm *= grip;
  limb.strength_N *= grip;
  return limb;
}

}  // namespace

struct HandAndDevice::IntendedMotion {
  bool holding;
  PlanarVector tip_m, tip_mps;
  double angle_rad, rate_radps;  // of the finger, absolute
  PlanarVector push_N;
  LimbImpedance limb;  // as it holds now

  /// Pull of the hand on the device's tip.
  [[nodiscard]] PlanarVector pull_N(const PlanarVector& at_m, const PlanarVector& at_mps) const noexcept {
    PlanarVector pull = limb.stiffness_N_per_m * (tip_m - at_m) + limb.damping_Ns_per_m * (tip_mps - at_mps) + push_N;
    const double size = pull.norm();
    if (size > limb.strength_N) pull *= limb.strength_N / size;
    return pull;
  }
};

HandAndDevice::HandAndDevice(const DeviceTruth& truth, const LimbImpedance& limb, HidPort& cable, std::uint64_t seed,
                             const JointVector& start_rad, std::uint32_t serial)
    : device_(truth.built),
      backlash_rad_(truth.backlash_rad),
      limb_(limb),
      firmware_(truth.described, cable, serial != 0 ? serial : std::max(truth.described.serial, 1u)) {
  std::mt19937_64 random(seed);
  const auto unit = [&random] { return unit_interval(random); };
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = Eigen::Index(i);
    rotor_inertia_kgm2_[row] = device_.gear_ratio[i] * device_.gear_ratio[i] * device_.rotor_inertia_kgm2[i];
    joint_inertia_kgm2_[row] = device_.link_inertia_kgm2[i] + rotor_inertia_kgm2_[row];
    friction_Nm_[row] = device_.friction_Nm[i] * (0.8 + 0.4 * unit());
    cogging_phase_rad_[row] = kTurn * unit();
  }
  truth_.joint_rad = motor_rad_ = start_rad;
  current_follows_ = 1 - std::exp(-kDt_s / kCurrentLag_s);
  posture_ = posture_at(start_rad);
  truth_.tip_m = posture_.tip_m;
}

HandAndDevice::Posture HandAndDevice::posture_at(const JointVector& joint_rad) const noexcept {
  const double forearm = joint_rad[0], hand = forearm + joint_rad[1], finger = hand + joint_rad[2];
  const PlanarVector a = device_.link_m[0] * PlanarVector(std::cos(forearm), std::sin(forearm));
  const PlanarVector b = device_.link_m[1] * PlanarVector(std::cos(hand), std::sin(hand));
  const PlanarVector c = device_.link_m[2] * PlanarVector(std::cos(finger), std::sin(finger));
  Posture posture;
  posture.tip_m = a + b + c;
  posture.jacobian << -a.y() - b.y() - c.y(), -b.y() - c.y(), -c.y(), a.x() + b.x() + c.x(), b.x() + c.x(), c.x();
  return posture;
}

void HandAndDevice::step(Time now, const OperatorIntent& intent) noexcept {
  const Posture meant = posture_at(intent.joint_rad);
  const IntendedMotion intended{
      intent.presence,         meant.tip_m,   meant.jacobian * intent.rate_radps, intent.joint_rad.sum(),
      intent.rate_radps.sum(), intent.push_N, scaled_by_grip(limb_, intent.grip)};
  const LimbImpedance& limb = intended.limb;
  Eigen::Matrix3d mass = joint_inertia_kgm2_.asDiagonal();
  for (std::size_t i = 0; i < kJoints; ++i) mass(Eigen::Index(i), Eigen::Index(i)) += kDt_s * device_.viscous_Nms[i];
  if (intent.presence) {
    const auto implicit = [](double m, double d, double k) { return m + kDt_s * d + kDt_s * kDt_s * k; };
    mass += implicit(limb.mass_kg, limb.damping_Ns_per_m, limb.stiffness_N_per_m) * posture_.jacobian.transpose() *
            posture_.jacobian;
    mass.array() += implicit(limb.wrist_inertia_kgm2, limb.wrist_damping_Nms, limb.wrist_stiffness_Nm);
  }
  const Eigen::Matrix3d inverse_mass = mass.inverse();

  const PlanarVector tip_mps_before = posture_.jacobian * truth_.rate_radps;
  for (int i = 0; i < kSubsteps; ++i) {
    drive_motors();
    substep(intended, inverse_mass);
    cross_backlash(kDt_s);
    firmware_.track(counts(), kDt_s);
  }

  posture_ = posture_at(truth_.joint_rad);
  const Eigen::Matrix<double, 2, 3>& jacobian = posture_.jacobian;
  truth_.tip_m = posture_.tip_m;
  truth_.tip_mps = jacobian * truth_.rate_radps;
  const Eigen::Matrix2d gram = jacobian * jacobian.transpose() + 1e-5 * Eigen::Matrix2d::Identity();
  truth_.felt_N = gram.inverse() * (jacobian * truth_.motor_torque_Nm);
  truth_.contact_N.setZero();
  if (intent.presence) {
    truth_.contact_N = limb.mass_kg * (truth_.tip_mps - tip_mps_before) / kFirmwareTick_s -
                       intended.pull_N(truth_.tip_m, truth_.tip_mps);
  }
  asked_A_ = firmware_.step(now, DeviceSensors{counts(), current_A_, truth_.motor_heat, intent.presence, intent.enable,
                                               intent.clutch, intent.stop});
}

void HandAndDevice::substep(const IntendedMotion& intended, const Eigen::Matrix3d& inverse_mass) noexcept {
  JointVector torque = truth_.motor_torque_Nm + cogging() - friction(kDt_s);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = Eigen::Index(i);
    const double rate = truth_.rate_radps[row];
    torque[row] -= device_.viscous_Nms[i] * rate;
    const double beyond =
        truth_.joint_rad[row] - std::clamp(truth_.joint_rad[row], device_.min_rad[i], device_.max_rad[i]);
    if (beyond != 0) torque[row] -= kStop_Nm_per_rad * beyond + kStop_Nms * rate;
  }
  if (intended.holding) {
    const PlanarVector tip_mps = posture_.jacobian * truth_.rate_radps;
    const double rate = truth_.rate_radps.sum();
    const LimbImpedance& limb = intended.limb;
    const PlanarVector pull = intended.pull_N(posture_.tip_m + kDt_s * tip_mps, tip_mps);
    const double most_Nm = limb.strength_N * (device_.link_m[1] + device_.link_m[2]);  // as far as the finger reaches
    const double twist = limb.wrist_stiffness_Nm * (intended.angle_rad - truth_.joint_rad.sum() - kDt_s * rate) +
                         limb.wrist_damping_Nms * (intended.rate_radps - rate);
    torque += posture_.jacobian.transpose() * pull + JointVector::Constant(std::clamp(twist, -most_Nm, most_Nm));
  }
  const JointVector rate_before = truth_.rate_radps;
  truth_.rate_radps += kDt_s * (inverse_mass * torque);
  truth_.joint_rad += kDt_s * truth_.rate_radps;
  posture_.tip_m += kDt_s * (posture_.jacobian * truth_.rate_radps);
  truth_.energy_to_hand_J += kDt_s * 0.5 * truth_.motor_torque_Nm.dot(rate_before + truth_.rate_radps);
}

JointVector HandAndDevice::friction(double dt_s) noexcept {
  // Dahl: z' = v - |v| z / z_max, stepped implicitly in z; friction = F_c z / z_max, never above F_c.
  JointVector friction_Nm;
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const double travel = dt_s * truth_.rate_radps[i];
    bristle_rad_[i] = (bristle_rad_[i] + travel) / (1 + std::abs(travel) / kBristle_rad);
    const double micro_damping = 5e-3 * friction_Nm_[i] / kBristle_rad;  // settles the bristle's own ringing
    friction_Nm[i] = friction_Nm_[i] * bristle_rad_[i] / kBristle_rad +
                     std::clamp(micro_damping * truth_.rate_radps[i], -friction_Nm_[i], friction_Nm_[i]) *
                         (1 - std::abs(bristle_rad_[i]) / kBristle_rad);
  }
  return friction_Nm;
}

JointVector HandAndDevice::cogging() const noexcept {
  JointVector cogging_Nm;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = Eigen::Index(i);
    const double periods = device_.cogging_periods[i] * device_.gear_ratio[i];
    cogging_Nm[row] = device_.cogging_Nm[i] * std::sin(periods * truth_.joint_rad[row] + cogging_phase_rad_[row]);
  }
  return cogging_Nm;
}

void HandAndDevice::drive_motors() noexcept {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double limit_A = device_.peak_current_A[i];
    const double asked_A = std::clamp(asked_A_[i], -limit_A, limit_A);
    current_A_[i] += current_follows_ * (asked_A - current_A_[i]);
    const double share = current_A_[i] / device_.rated_current_A[i];
    truth_.motor_heat[i] += (share * share - truth_.motor_heat[i]) * kDt_s / device_.thermal_time_constant_s[i];
    truth_.motor_torque_Nm[Eigen::Index(i)] =
        device_.joint_sign[i] * device_.gear_ratio[i] * device_.torque_constant_Nm_per_A[i] * current_A_[i];
  }
}

/// Where the motors are, as angles of their joints. In a gear with play a motor turns by itself from one side of it to
/// the other; what the joint feels meanwhile is left as it is: it takes some milliseconds.
void HandAndDevice::cross_backlash(double dt_s) noexcept {
  constexpr double kMotorsShare = 0.3;  // of the joint's friction
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const double half = 0.5 * backlash_rad_[i], joint = truth_.joint_rad[i];
    if (half == 0) {
      motor_rad_[i] = joint;
      continue;
    }
    const double driven = motor_radps_[i] + dt_s * truth_.motor_torque_Nm[i] / rotor_inertia_kgm2_[i];
    const double lost = dt_s * kMotorsShare * friction_Nm_[i] / rotor_inertia_kgm2_[i];
    motor_radps_[i] = std::copysign(std::max(0.0, std::abs(driven) - lost), driven);
    const double free = motor_rad_[i] + dt_s * motor_radps_[i];
    motor_rad_[i] = std::clamp(free, joint - half, joint + half);
    if (motor_rad_[i] != free) motor_radps_[i] = truth_.rate_radps[i];
  }
}

PerJoint<std::int32_t> HandAndDevice::counts() const noexcept {
  PerJoint<std::int32_t> counts;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double per_rad = device_.joint_sign[i] * device_.gear_ratio[i] * device_.counts_per_turn[i] / kTurn;
    counts[i] = device_.zero_counts[i] + std::int32_t(std::floor(per_rad * motor_rad_[Eigen::Index(i)]));
  }
  return counts;
}

}  // namespace knuckle::sim
