#include "app/studies/contact_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "estimation/regressor.h"
#include "slave/contact_law.h"

namespace knuckle::studies {
namespace {

using Complex = std::complex<double>;
using Matrix2c = Eigen::Matrix2cd;
using Matrix3c = Eigen::Matrix3cd;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kLeastDrop_Pa = 3e5;  // of the law
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

std::optional<LoopCrossing> largest_crossing(const LoopEigenvalues& eigenvalues) {
  std::optional<LoopCrossing> found;
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
      if (re > 0 && (!found || re > found->gain)) found = {{re, w / kTurn}};
    }
    before = now;
  }
  return found;
}

double ContactLoop::bulk_modulus_Pa(double pressure_Pa) const noexcept {
  const double part = nominal_.air_Pa / (std::max(0.0, pressure_Pa) + nominal_.air_Pa);
  return nominal_.oil_share * machine_.hydraulics.bulk_modulus_Pa / (1 + nominal_.air_share * part * part * part);
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
  touch_wall();
  set_law();
  const std::array<JointVector, 2> supply_Pa = supplies_Pa();
  for (std::size_t i = 0; i < kJoints; ++i) axes_[i] = axis(i, supply_Pa);
}

void ContactLoop::touch_wall() {
  from_tip_m_ =
      Eigen::Rotation2Dd(hold_.joint_rad.sum()) * (hold_.place_m - PlanarVector(machine_.links[kBucket].length_m, 0));
  place_ = kinematics_.tip_jacobian(hold_.joint_rad);  // each joint turns the place about itself, as it does the tip
  place_.colwise() += PlanarVector(-from_tip_m_.y(), from_tip_m_.x());
  const PlanarVector normal = hold_.normal, along(-normal.y(), normal.x());
  const double mass_kg = 1 / (normal.transpose() * place_ * mass_.inverse() * place_.transpose() * normal).value();
  const double damping = 2 * hold_.wall_damping_ratio * std::sqrt(hold_.wall_N_per_m * mass_kg);
  const Eigen::Matrix2d across = normal * normal.transpose();
  const Eigen::Matrix2d sideways = (hold_.sticks ? 1 : 0) * along * along.transpose();
  wall_N_per_m_ = hold_.wall_N_per_m * across + nominal_.along_N_per_m * sideways;
  wall_Ns_per_m_ = damping * across + nominal_.along_Ns_per_m * sideways;
}

/// At rest position and force ask for nothing together, so what slows them counts as it is there.
void ContactLoop::set_law() {
  const slave::ContactLaw law(machine_);
  estimation::JointState state;
  state.angle_rad = hold_.joint_rad;
  for (std::size_t i = 0; i < kJoints; ++i) state.lever_m[static_cast<int>(i)] = cylinder(i).lever_m;
  const Eigen::Matrix<double, 2, 3> tip = kinematics_.tip_jacobian(hold_.joint_rad);
  const auto touched = [&](const PlanarVector& force_N) {
    estimation::ForceEstimate force;
    force.confidence = 1;
    force.fast_torque_Nm = tip.transpose() * force_N;
    force.fast_couple_Nm = cross(from_tip_m_, force_N);
    return law.touch(state, force);
  };
  JointVector gains = JointVector::Constant(machine_.control.position_gain_1ps);
  gains[kBucket] = machine_.control.bucket_position_gain_1ps;
  for (int i = 0; i < kJoints; ++i) {
    rate_per_rad_.col(i) = law.steadied_radps(gains[i] * JointVector::Unit(i), touched(hold_.force_N), state);
  }
  constexpr double kApart_N = 1;
  for (int i = 0; i < 2; ++i) {
    const PlanarVector apart_N = kApart_N * PlanarVector::Unit(i);
    const JointVector less_rad = law.give_rad(touched(hold_.force_N - apart_N));
    const JointVector more_rad = law.give_rad(touched(hold_.force_N + apart_N));
    rate_per_N_.col(i) = rate_per_rad_ * (more_rad - less_rad) / (2 * kApart_N);
  }
}

/// Load sensing holds the highest pressure that is fed, plus its margin: one way while pressing, another while giving
/// way. @return for each cylinder while it extends, and while it retracts.
std::array<JointVector, 2> ContactLoop::supplies_Pa() const {
  const JointVector press = -(rate_per_N_ * hold_.normal);
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

std::array<Complex, 2> ContactLoop::eigenvalues(double w) const {
  const Complex s(0, w);
  const Eigen::Matrix<Complex, 2, 3> wall =
      (wall_N_per_m_.cast<Complex>() + wall_Ns_per_m_ * s) * place_.cast<Complex>();
  Matrix3c arm = (mass_ * (s * s)).eval() + place_.transpose().cast<Complex>() * wall;
  Eigen::Vector3cd drive;
  const double period_s = machine_.bus.set_point_every_nth_sync / machine_.bus.sync_Hz;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const Axis& a = axes_[i];
    const double lever2 = a.lever_m * a.lever_m;
    arm(n, n) += lever2 * (a.oil_N_per_m + a.seal_N_per_m + a.damping_Ns_per_m * s);
    const Complex spool =
        1.0 / (1.0 + 2 * a.valve_damping * s / a.valve_radps + s * s / (a.valve_radps * a.valve_radps));
    const Complex valve = spool * std::polar(1.0, -w * a.delay_s) * hold_of(w, period_s);
    drive[n] = lever2 * a.oil_N_per_m * a.flow_share * valve / s;
  }
  const Matrix3c to_position = arm.inverse() * Matrix3c(drive.asDiagonal());
  const Complex velocity = low_pass(w, nominal_.force_band.velocity_Hz);
  const Complex filters = velocity * velocity * low_pass(w, nominal_.force_band.observer_Hz);
  const Matrix3c held = Matrix3c::Identity() + to_position * rate_per_rad_.cast<Complex>();
  const Matrix2c loop = -filters * wall * held.inverse() * to_position * rate_per_N_.cast<Complex>();
  const Complex half = 0.5 * loop.trace(), root = std::sqrt(half * half - loop.determinant());
  const Complex one = half + root, other = half - root;
  if (std::abs(one) >= std::abs(other)) return {one, other};
  return {other, one};
}

std::optional<LoopCrossing> ContactLoop::crossing() const {
  return largest_crossing([&](double w_radps) { return eigenvalues(w_radps); });
}

std::optional<ContactMargins> ContactLoop::margins() const {
  std::optional<ContactMargins> found;
  double before = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double w = frequency(i);
    const Complex loop = eigenvalues(w)[0];
    const double size = std::abs(loop);
    if (i > 0 && before >= 1 && size < 1) {
      found = {{w / kTurn, std::arg(loop) * 360 / kTurn}};  // at 0 the swing comes back as it went
    }
    before = size;
  }
  return found;
}

std::optional<PredictedBorder> stiffness_border(MachineDescription machine, const ContactHold& hold,
                                                const ContactNominal& nominal) {
  machine.control.contact_crossover_radps = kNoBound_radps;
  const auto crossing = ContactLoop(machine, hold, nominal).crossing();
  if (!crossing) return std::nullopt;
  return {{crossing->gain * machine.control.tip_stiffness_N_per_m, crossing->frequency_Hz}};
}

std::optional<PredictedBorder> crossover_border(MachineDescription machine, const ContactHold& hold,
                                                const ContactNominal& nominal) {
  const auto crossing = [&](double crossover_radps) {
    machine.control.contact_crossover_radps = crossover_radps;
    return ContactLoop(machine, hold, nominal).crossing().value_or(LoopCrossing{});
  };
  LoopCrossing swings = crossing(kFastest_radps);
  if (swings.gain <= 1) return std::nullopt;
  double calm_radps = kSlowest_radps, swings_radps = kFastest_radps;
  while (swings_radps > 1.005 * calm_radps) {
    const double middle_radps = std::sqrt(calm_radps * swings_radps);
    const LoopCrossing found = crossing(middle_radps);
    (found.gain > 1 ? swings_radps : calm_radps) = middle_radps;
    if (found.gain > 1) swings = found;
  }
  return {{swings_radps, swings.frequency_Hz}};
}

}  // namespace knuckle::studies
