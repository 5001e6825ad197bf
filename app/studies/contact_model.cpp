#include "app/studies/contact_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "estimation/regressor.h"

namespace knuckle::studies {
namespace {

using Complex = std::complex<double>;
using Matrix2c = Eigen::Matrix2cd;
using Matrix3c = Eigen::Matrix3cd;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kSingularity = 0.02, kLeastDrop_Pa = 3e5;  // of the law
constexpr double kLowest_radps = 0.5, kHighest_radps = 200;
constexpr int kPlaces = 400;

/// Sampled at a period and held over it: mean delay half a period.
Complex hold_of(double w, double period_s) noexcept {
  const double half = 0.5 * w * period_s;
  return std::polar(std::sin(half) / half, -half);
}

Complex low_pass(double w, double cutoff_Hz) noexcept {
  return 1.0 / Complex(1, w / (kTurn * cutoff_Hz));
}

Eigen::Matrix3d mass_of(const MachineDescription& machine, const JointVector& joint_rad) {
  const estimation::RigidArm arm(machine);
  const estimation::Pose pose(joint_rad, 0);
  const estimation::BaseParameters parameters = estimation::lumped_parameters(machine);
  Eigen::Matrix3d mass;
  for (int i = 0; i < kJoints; ++i) {
    const JointVector rate = estimation::absolute(JointVector::Unit(i));
    mass.col(i) = estimation::joint_torque(arm.momentum(pose, rate) * parameters);
  }
  return mass;
}

double frequency(int place) noexcept {
  return kLowest_radps * std::pow(kHighest_radps / kLowest_radps, static_cast<double>(place) / (kPlaces - 1));
}

double edge_flow(double drop_Pa, double laminar_Pa) noexcept {
  if (drop_Pa <= 0) return 0;
  return drop_Pa / std::sqrt(std::hypot(drop_Pa, laminar_Pa));
}

}  // namespace

double dead_zone_gain(double dead_zone, double amplitude) noexcept {
  if (amplitude <= dead_zone) return 0;
  const double part = dead_zone / amplitude;
  return 1 - 2 / std::numbers::pi * (std::asin(part) + part * std::sqrt(1 - part * part));
}

std::optional<ContactCrossing> swing_border(const LoopEigenvalues& eigenvalues) {
  std::optional<ContactCrossing> found;
  std::array<Complex, 2> before{};
  for (int i = 0; i < kPlaces; ++i) {
    std::array<Complex, 2> now = eigenvalues(frequency(i));
    const double straight = std::abs(now[0] - before[0]) + std::abs(now[1] - before[1]);
    const double crossed = std::abs(now[0] - before[1]) + std::abs(now[1] - before[0]);
    if (crossed < straight) std::swap(now[0], now[1]);  // each goes on from where it was
    for (std::size_t k = 0; i > 0 && k < 2; ++k) {
      const double im0 = before[k].imag(), im1 = now[k].imag();
      if (im0 * im1 > 0 || im0 == im1) continue;
      const double part = im0 / (im0 - im1);
      const double re = before[k].real() + part * (now[k].real() - before[k].real());
      const double w = frequency(i - 1) + part * (frequency(i) - frequency(i - 1));
      if (re > 0 && (!found || re > found->stiffness_N_per_m)) found = {{re, w / kTurn}};
    }
    before = now;
  }
  return found;
}

double ContactLoop::bulk_modulus_Pa(double pressure_Pa) const noexcept {
  const double part = nominal_.air_Pa / (std::max(0.0, pressure_Pa) + nominal_.air_Pa);
  return machine_.hydraulics.bulk_modulus_Pa / (1 + nominal_.air_share * part * part * part);
}

ContactLoop::Axis ContactLoop::axis(std::size_t i, const std::array<JointVector, 2>& supply_Pa) const {
  const CylinderState state = this->cylinder(i);
  const CylinderDescription& cylinder = machine_.cylinders[i];
  const HydraulicsDescription& h = machine_.hydraulics;
  const double head = cylinder.head_area_m2(), rod = cylinder.rod_side_area_m2();
  const double pa = hold_.chamber_Pa[2 * i], pb = hold_.chamber_Pa[2 * i + 1], load = pa * head - pb * rod;
  const double stiff_a =
      bulk_modulus_Pa(pa) * head / (h.hose_volume_m3 + head * std::max(0.0, state.length_m - cylinder.min_length_m));
  const double stiff_b =
      bulk_modulus_Pa(pb) * rod / (h.hose_volume_m3 + rod * std::max(0.0, cylinder.max_length_m - state.length_m));
  Axis axis;
  axis.lever_m = state.lever_m;
  axis.oil_N_per_m = stiff_a * head + stiff_b * rod;
  // Extending and retracting by turns: the mean of both.
  for (const bool extend : {true, false}) {
    const double ps = supply_Pa[extend ? 0 : 1][static_cast<int>(i)], laminar = nominal_.laminar_drop_Pa;
    const double flow_a = edge_flow(extend ? ps - pa : pa - h.tank_Pa, laminar);
    const double flow_b = edge_flow(extend ? pb - h.tank_Pa : ps - pb, laminar);
    const double in = extend ? head : rod, out = extend ? rod : head;
    const double drive = std::max(ps * in - h.tank_Pa * out - (extend ? load : -load), kLeastDrop_Pa * (in + out));
    const double believed = std::sqrt(drive / (head * head * head + rod * rod * rod));
    axis.flow_share += 0.5 * (stiff_a * flow_a + stiff_b * flow_b) / (axis.oil_N_per_m * believed);
    const double band = extend ? cylinder.valve.dead_band_extend : cylinder.valve.dead_band_retract;
    const double k = cylinder.valve.nominal_flow_m3ps / std::sqrt(cylinder.valve.nominal_drop_Pa);
    axis.dead_zone_mps += 0.5 * k * believed * (1 - machine_.control.dead_band_fill) * band / (1 - band);
  }
  axis.damping_Ns_per_m = cylinder.friction.viscous_Ns_per_m;
  axis.seal_N_per_m = nominal_.seal_N_per_m;
  axis.valve_radps = kTurn * cylinder.valve.natural_frequency_Hz;
  axis.valve_damping = cylinder.valve.damping_ratio;
  axis.delay_s = cylinder.valve.delay_s + nominal_.bus_delay_s;
  return axis;
}

ContactLoop::ContactLoop(const MachineDescription& machine, const ContactHold& hold, const ContactNominal& nominal)
    : machine_(machine), hold_(hold), nominal_(nominal), kinematics_(machine), mass_(mass_of(machine, hold.joint_rad)) {
  const Eigen::Matrix<double, 2, 3> tip = kinematics_.tip_jacobian(hold.joint_rad);
  const JointVector weight = machine.control.stiffness_radius_m.cwiseAbs2().cwiseInverse();
  const Eigen::Matrix<double, 3, 2> weighted = weight.asDiagonal() * tip.transpose();
  to_joints_ = weighted * Eigen::Matrix2d(tip * weighted + kSingularity * Eigen::Matrix2d::Identity()).inverse();
  gains_.setConstant(machine.control.position_gain_1ps);
  gains_[kBucket] = machine.control.bucket_position_gain_1ps;
  touch(tip);
  const std::array<JointVector, 2> supply_Pa = supplies_Pa();
  for (std::size_t i = 0; i < kJoints; ++i) axes_[i] = axis(i, supply_Pa);
}

/// The wall's spring and damper between joints, and between joints and what the estimator takes for a force at the tip.
void ContactLoop::touch(const Eigen::Matrix<double, 2, 3>& tip) {
  const PlanarVector from_tip =
      Eigen::Rotation2Dd(hold_.joint_rad.sum()) * (hold_.place_m - PlanarVector(machine_.links[kBucket].length_m, 0));
  Eigen::Matrix<double, 2, 3> place = tip;  // each joint turns the place about itself, as it does the tip
  place.colwise() += PlanarVector(-from_tip.y(), from_tip.x());
  const PlanarVector normal = hold_.normal, along(-normal.y(), normal.x());
  effective_mass_kg_ = 1 / (normal.transpose() * place * mass_.inverse() * place.transpose() * normal).value();
  const double damping = 2 * hold_.wall_damping_ratio * std::sqrt(hold_.wall_N_per_m * effective_mass_kg_);
  const double slide_N = hold_.sticks ? nominal_.along_N_per_m : 0;
  const double slide_Ns = hold_.sticks ? nominal_.along_Ns_per_m : 0;
  const Eigen::Matrix2d across = normal * normal.transpose(), sideways = along * along.transpose();
  const Eigen::Matrix<double, 2, 3> spring = (hold_.wall_N_per_m * across + slide_N * sideways) * place;
  const Eigen::Matrix<double, 2, 3> damper = (damping * across + slide_Ns * sideways) * place;
  wall_N_ = place.transpose() * spring;
  wall_Ns_ = place.transpose() * damper;
  felt_N_ = tip.transpose() * spring;
  felt_Ns_ = tip.transpose() * damper;
}

/// Load sensing holds the highest pressure that is fed, plus its margin: one way while pressing, another while giving
/// way. @return for each cylinder while it extends, and while it retracts.
std::array<JointVector, 2> ContactLoop::supplies_Pa() const {
  const JointVector press = -(to_joints_ * hold_.normal);
  std::array<double, 2> highest{machine_.hydraulics.tank_Pa, machine_.hydraulics.tank_Pa};  // pressing, giving way
  PerJoint<bool> extends_pressing{};
  for (std::size_t i = 0; i < kJoints; ++i) {
    extends_pressing[i] = cylinder(i).lever_m * press[static_cast<int>(i)] > 0;
    for (std::size_t phase = 0; phase < 2; ++phase) {
      const bool extends = extends_pressing[i] == (phase == 0);
      highest[phase] = std::max(highest[phase], hold_.chamber_Pa[2 * i + (extends ? 0 : 1)]);
    }
  }
  std::array<JointVector, 2> supply_Pa;
  for (std::size_t i = 0; i < kJoints; ++i) {
    for (std::size_t way = 0; way < 2; ++way) {
      const double load = highest[extends_pressing[i] == (way == 0) ? 0 : 1];
      supply_Pa[way][static_cast<int>(i)] =
          std::min(load + machine_.hydraulics.load_sensing_margin_Pa, machine_.hydraulics.main_relief_Pa);
    }
  }
  return supply_Pa;
}

CylinderState ContactLoop::cylinder(std::size_t i) const {
  const auto n = static_cast<int>(i);
  const auto state = kinematics_.cylinder_at(n, hold_.joint_rad[n]);
  if (!state) throw std::invalid_argument("contact loop: a linkage does not reach the pose");
  return *state;
}

std::array<Complex, 2> ContactLoop::eigenvalues(double w, const JointVector& valve_gain) const {
  const Complex s(0, w);
  Matrix3c arm = (mass_ * (s * s)).eval() + wall_N_.cast<Complex>() + wall_Ns_ * s;
  Eigen::Vector3cd drive;
  const double period_s = machine_.bus.valve_every_nth_sync / machine_.bus.sync_Hz;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const Axis& a = axes_[i];
    const double lever2 = a.lever_m * a.lever_m;
    arm(n, n) += lever2 * (a.oil_N_per_m + a.seal_N_per_m + a.damping_Ns_per_m * s);
    const Complex spool =
        1.0 / (1.0 + 2 * a.valve_damping * s / a.valve_radps + s * s / (a.valve_radps * a.valve_radps));
    const Complex valve = spool * std::polar(1.0, -w * a.delay_s) * hold_of(w, period_s);
    drive[n] = lever2 * a.oil_N_per_m * a.flow_share * valve_gain[n] * valve / s;
  }
  const Matrix3c to_position = arm.inverse() * Matrix3c(drive.asDiagonal());
  const Complex velocity = low_pass(w, nominal_.force_band.velocity_Hz);
  const Complex filters = velocity * velocity * low_pass(w, nominal_.force_band.observer_Hz);
  const Matrix3c to_torque = -filters * (felt_N_.cast<Complex>() + felt_Ns_ * s) * to_position;
  const Matrix3c gains = gains_.cast<Complex>().asDiagonal();
  // P_t (1 + K P_q)^-1 K = P_t K (1 + P_q K)^-1 for a diagonal K
  const Matrix2c b = to_joints_.transpose().cast<Complex>() * to_torque * gains *
                     (Matrix3c::Identity() + to_position * gains).inverse() * to_joints_.cast<Complex>();
  const Complex half = 0.5 * b.trace(), root = std::sqrt(half * half - b.determinant());
  const Complex one = half + root, other = half - root;
  if (std::abs(one) >= std::abs(other)) return {one, other};
  return {other, one};
}

std::optional<ContactCrossing> ContactLoop::border() const {
  return border(JointVector::Ones());
}

std::optional<ContactCrossing> ContactLoop::border(const JointVector& valve_gain) const {
  return swing_border([&](double w_radps) { return eigenvalues(w_radps, valve_gain); });
}

std::optional<ContactCrossing> ContactLoop::border_with_dead_band(double swing_N) const {
  const JointVector give = gains_.cwiseProduct(to_joints_ * hold_.normal * swing_N);  // rates times Ks
  std::optional<ContactCrossing> last = border();
  if (!last) return last;
  // A softer loop asks for quicker valves, which pass more: one solution, between no gain and all of it.
  double low = 1e-3 * last->stiffness_N_per_m, high = last->stiffness_N_per_m;
  for (int i = 0; i < 30; ++i) {
    const double middle = std::sqrt(low * high);
    JointVector passes;
    for (int k = 0; k < kJoints; ++k) {
      const Axis& a = axes_[static_cast<std::size_t>(k)];
      passes[k] = dead_zone_gain(a.dead_zone_mps, std::abs(a.lever_m * give[k]) / middle);
    }
    const auto found = border(passes);
    if (found) last = found;
    (found && found->stiffness_N_per_m > middle ? low : high) = middle;
  }
  last->stiffness_N_per_m = std::sqrt(low * high);
  return last;
}

std::optional<double> ContactLoop::lasting_swing_N(double stiffness_N_per_m) const {
  const auto goes_on = [&](double swing_N) {
    const auto found = border_with_dead_band(swing_N);
    return found && found->stiffness_N_per_m > stiffness_N_per_m;
  };
  double calm = 1, lasting = 1e5;
  if (!goes_on(lasting)) return std::nullopt;
  while (lasting > 1.02 * calm) {
    const double middle = std::sqrt(calm * lasting);
    (goes_on(middle) ? lasting : calm) = middle;
  }
  return lasting;
}

std::optional<ContactMargins> ContactLoop::margins(double stiffness_N_per_m) const {
  std::optional<ContactMargins> found;
  double before = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double w = frequency(i);
    const Complex loop = eigenvalues(w)[0] / stiffness_N_per_m;
    const double size = std::abs(loop);
    if (i > 0 && before >= 1 && size < 1) {
      found = {{w / kTurn, std::arg(loop) * 360 / kTurn}};  // at 0 the swing comes back as it went
    }
    before = size;
  }
  return found;
}

}  // namespace knuckle::studies
