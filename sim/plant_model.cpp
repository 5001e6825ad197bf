#include "sim/plant_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "core/error.h"

namespace knuckle::sim {
namespace {

constexpr double kEndStop_N_per_m = 5e7;
constexpr double kEndStop_Ns_per_m = 2e5;
constexpr double kCushion_m = 0.015;         // throttled end of the stroke
constexpr double kCushion_Ns_per_m = 1.5e5;  // at its very end
// Steel on steel where a linkage would pass its working range (a pin out of place can make the cylinder's stop late).
constexpr double kJointStopMargin_rad = 0.04;
constexpr PerJoint<double> kJointStop_Nm{2e6, 5e5, 2e5};
constexpr PerJoint<double> kJointStop_Nms{2e4, 5e3, 1e3};
constexpr double kThinning_1pK = 0.035;    // ISO VG 46: 46 mm^2/s at 40 degC, 16 at 70
constexpr double kRestPressure_Pa = 10e5;  // in the side of a cylinder that does not carry

/// Damping that acts only while closing in, so that a stop never pulls.
double one_sided(double push, double damping) noexcept {
  return std::max(0.0, push + damping);
}

/// How far a rod is ahead of its link, the play taken off; positive presses.
double pressed_m(double ahead_m, double play_m) noexcept {
  return ahead_m - std::clamp(ahead_m, -0.5 * play_m, 0.5 * play_m);
}

}  // namespace

PlantModel::PlantModel(const MachineTruth& truth)
    : truth_(truth), body_(truth.machine, truth.hull_pitch_rad), hull_(truth.hull, truth.hull_pitch_rad) {
  check_truth(truth);
  viscosity_ = truth.viscosity_factor;
  const HydraulicsDescription& hydraulics = truth.machine.hydraulics;
  oil_.bulk_modulus_Pa = hydraulics.bulk_modulus_Pa;
  for (std::size_t i = 0; i < kJoints; ++i) {
    axes_[i] = AxisConstants(truth.machine.cylinders[i]);
    const LuGreFriction& f = truth.friction[i];
    const double mean = 0.5 * (f.coulomb_extend_N + f.coulomb_retract_N);
    bristles_[i] = {mean / f.presliding_m,
                    f.coulomb_extend_N,
                    f.coulomb_retract_N,
                    f.static_ratio - 1,
                    1 / (f.stribeck_mps * f.stribeck_mps),
                    f.micro_damping_Ns_per_m,
                    f.viscous_Ns_per_m * truth.viscosity_factor,
                    f.seal_N_per_Pa,
                    f.pin_share};
  }
  pins_compliant_ =
      std::any_of(truth.pin.begin(), truth.pin.end(), [](const PinTruth& pin) { return pin.compliant(); });
  relief_gain_ = hydraulics.pump_flow_m3ps / (kReliefOverride * hydraulics.port_relief_Pa);
  main_relief_gain_ = hydraulics.pump_flow_m3ps / (kReliefOverride * hydraulics.main_relief_Pa);
  suck_gain_ = 8e3 * hydraulics.hose_volume_m3 / oil_.bulk_modulus_Pa;
  regulator_gain_ = hydraulics.pump_flow_m3ps / kPumpDroop_Pa;
}

double PlantModel::head_volume(std::size_t i, double length_m) const noexcept {
  return truth_.machine.hydraulics.hose_volume_m3 +
         axes_[i].head_area_m2 * std::max(0.0, length_m - axes_[i].min_length_m);
}

double PlantModel::rod_volume(std::size_t i, double length_m) const noexcept {
  return truth_.machine.hydraulics.hose_volume_m3 +
         axes_[i].rod_area_m2 * std::max(0.0, axes_[i].max_length_m - length_m);
}

double PlantModel::bristle_energy(std::size_t i, double z_m) const noexcept {
  return 0.5 * bristles_[i].stiffness * z_m * z_m;
}

double PlantModel::stop_spring(std::size_t i, double length_m) const noexcept {
  const double in = std::max(0.0, axes_[i].min_length_m - length_m);
  const double out = std::max(0.0, length_m - axes_[i].max_length_m);
  return kEndStop_N_per_m * (in - out);
}

double PlantModel::stop_energy(std::size_t i, double length_m) const noexcept {
  const double spring = stop_spring(i, length_m);
  return 0.5 * spring * spring / kEndStop_N_per_m;
}

double PlantModel::joint_stop_spring(std::size_t i, double joint_rad) const noexcept {
  const LinkDescription& link = truth_.machine.links[i];
  const double low = std::max(0.0, link.min_rad - kJointStopMargin_rad - joint_rad);
  const double high = std::max(0.0, joint_rad - link.max_rad - kJointStopMargin_rad);
  return kJointStop_Nm[i] * (low - high);
}

double PlantModel::joint_stop_energy(std::size_t i, double joint_rad) const noexcept {
  const double spring = joint_stop_spring(i, joint_rad);
  return 0.5 * spring * spring / kJointStop_Nm[i];
}

double PlantModel::asked_flow(const StateVector& x, const HeldInputs& held) const noexcept {
  double asked = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double o = held.opening[i];
    const double load = x[(o > 0 ? kHead : kRod) + static_cast<Eigen::Index>(i)];
    asked += axes_[i].valve_gain * std::abs(o) * left_by_others(i, held) * orifice(std::max(0.0, x[kSense] - load));
  }
  return asked;
}

double PlantModel::left_by_others(std::size_t i, const HeldInputs& held) const noexcept {
  if (truth_.cross_talk == 0) return 1;
  double others = 0;
  for (std::size_t k = 0; k < kJoints; ++k) others += k == i ? 0 : std::min(1.0, std::abs(held.opening[k]));
  return std::max(0.0, 1 - truth_.cross_talk * others);
}

PlantModel::EndStop PlantModel::end_stop(std::size_t i, double length, double speed) const noexcept {
  const double in = length - axes_[i].min_length_m, out = axes_[i].max_length_m - length;
  if (in > kCushion_m && out > kCushion_m) return {};
  // sign: force on the rod, positive = extending
  const bool retracting_end = in < out;
  const double gap = retracting_end ? in : out;
  const double closing = retracting_end ? -speed : speed;
  const double part = std::clamp(1 - gap / kCushion_m, 0.0, 1.0);
  const double cushion = closing > 0 ? kCushion_Ns_per_m * part * part : 0;
  const double stop = gap < 0 ? one_sided(-kEndStop_N_per_m * gap, kEndStop_Ns_per_m * closing) : 0;
  const double force = cushion * closing + stop;
  return {retracting_end ? force : -force, cushion + (stop > 0 ? kEndStop_Ns_per_m : 0)};
}

double PlantModel::joint_stop(std::size_t i, double joint, double rate) const noexcept {
  if (joint > truth_.machine.links[i].min_rad && joint < truth_.machine.links[i].max_rad) return 0;
  const double spring = joint_stop_spring(i, joint);
  if (spring > 0) return one_sided(spring, -kJointStop_Nms[i] * rate);
  if (spring < 0) return -one_sided(-spring, kJointStop_Nms[i] * rate);
  return 0;
}

void PlantModel::friction(const StateVector& x, std::size_t i, PlantDetail& detail, StateVector& dx) const noexcept {
  const auto n = static_cast<Eigen::Index>(i);
  const BristleConstants& c = bristles_[i];
  const double v = detail.speed[n], z = x[kBristle + n];
  const double u = 1 + v * v * c.inverse_stribeck2;
  const double fade = 1 / u;
  const double loaded_N =
      c.seal_N_per_Pa * std::max(0.0, x[kHead + n] + x[kRod + n]) + c.pin_share * std::abs(detail.pressure_force[n]);
  // |v| sigma0 z / g(v) with g = F_c (1 + rise / u): the part of v that the bristles let go
  const double sliding_N = (v >= 0 ? c.extend_N : c.retract_N) + loaded_N;
  detail.bristle_decay_1ps[n] = std::abs(v) * c.stiffness * u / (sliding_N * (u + c.rise));
  const double slip = detail.bristle_decay_1ps[n] * z;
  const double z_rate = v - slip;
  const double damping = c.damping * fade;
  detail.friction[n] = c.stiffness * z + damping * z_rate + c.viscous * v;
  detail.rod_damping_Ns_per_m[n] = damping + c.viscous;
  detail.bristle_loss_W[n] = c.stiffness * z * slip + (damping * z_rate + c.viscous * v) * v;
  dx[kBristle + n] = z_rate;
}

void PlantModel::flows(const StateVector& x, const HeldInputs& held, PlantDetail& detail,
                       StateVector& dx) const noexcept {
  const HydraulicsDescription& h = truth_.machine.hydraulics;
  double highest_load = h.tank_Pa, total_feed = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    const double pa = x[kHead + n], pb = x[kRod + n];
    const double o = held.opening[i];
    double feed = 0, qa = 0, qb = 0;
    if (o != 0) {
      const double gain = axes_[i].valve_gain * std::abs(o) * left_by_others(i, held);
      const double fed = o > 0 ? pa : pb, emptied = o > 0 ? pb : pa;
      feed = gain * orifice(std::max(0.0, x[kPump] - fed));  // load check: never back into the pump line
      const double drain = gain * orifice(emptied - h.tank_Pa);
      qa = o > 0 ? feed : -drain;
      qb = o > 0 ? -drain : feed;
      highest_load = std::max(highest_load, fed);
      total_feed += feed;
    }
    const double suck_a = suck_gain_ * std::max(0.0, h.tank_Pa - pa);
    const double suck_b = suck_gain_ * std::max(0.0, h.tank_Pa - pb);
    const double leakage = thinner_ * truth_.valve[i].leakage_m3ps_per_Pa * (pa - pb);
    const double v = detail.speed[n];
    const double length = detail.length_m[n];
    const double rate_a = oil_.pressure_rate(pa, qa + suck_a - leakage - axes_[i].head_area_m2 * v - x[kHeadRelief + n],
                                             head_volume(i, length));
    const double rate_b = oil_.pressure_rate(pb, qb + suck_b + leakage + axes_[i].rod_area_m2 * v - x[kRodRelief + n],
                                             rod_volume(i, length));
    dx[kHead + n] = pa <= kVapour_Pa ? std::max(0.0, rate_a) : rate_a;
    dx[kRod + n] = pb <= kVapour_Pa ? std::max(0.0, rate_b) : rate_b;
    dx[kHeadRelief + n] =
        (relief_gain_ * std::max(0.0, pa - h.port_relief_Pa) - x[kHeadRelief + n]) * (1 / kReliefLag_s);
    dx[kRodRelief + n] = (relief_gain_ * std::max(0.0, pb - h.port_relief_Pa) - x[kRodRelief + n]) * (1 / kReliefLag_s);
    detail.feed[i] = feed;
    detail.leakage[i] = leakage;
    detail.head_flow[i] = qa;
    detail.rod_flow[i] = qb;
    detail.head_suck[i] = suck_a;
    detail.rod_suck[i] = suck_b;
  }
  const double limit = std::min(h.pump_flow_m3ps, h.pump_power_W / std::max(1e5, x[kPump]));
  const double wanted = regulator_gain_ * (x[kSense] - x[kPump]);
  detail.pump_flow = std::clamp(wanted, 0.0, limit);
  detail.pump_at_limit = wanted > limit;
  detail.main_relief_flow = main_relief_gain_ * std::max(0.0, x[kPump] - h.main_relief_Pa);
  dx[kPump] = oil_.pressure_rate(x[kPump], detail.pump_flow - total_feed - detail.main_relief_flow, kPumpVolume_m3);
  const double target = std::min(highest_load + h.load_sensing_margin_Pa, h.main_relief_Pa);
  if (const PumpTruth& pump = truth_.pump; pump.regulator_Hz > 0) {
    const double w = 2 * std::numbers::pi * pump.regulator_Hz;
    dx[kSense] = x[kSenseRate];
    dx[kSenseRate] = w * (w * (target - x[kSense]) - 2 * pump.regulator_damping * x[kSenseRate]);
  } else {
    dx[kSense] = (target - x[kSense]) / h.load_sensing_lag_s;
    dx[kSenseRate] = 0;
  }
}

void PlantModel::rod_ends(const StateVector& x, PlantDetail& detail) const noexcept {
  detail.length_m = detail.pose.length_m;
  detail.speed = detail.pose.lever_m.cwiseProduct(x.segment<3>(kRate));
  if (!pins_compliant_) return;
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (!truth_.pin[i].compliant()) continue;
    const auto n = static_cast<Eigen::Index>(i);
    detail.length_m[n] = x[kRodEnd + n];
    detail.speed[n] = x[kRodEndRate + n];
  }
}

/// Force of a cylinder on its link, and the rod's own motion where the pin between them yields.
void PlantModel::push_link(const StateVector& x, std::size_t i, PlantDetail& detail, StateVector& dx) const noexcept {
  const auto n = static_cast<Eigen::Index>(i);
  const double rod_N = detail.pressure_force[n] - detail.friction[n] + detail.stop_force[n];
  const PinTruth& pin = truth_.pin[i];
  detail.pin_N[n] = rod_N;
  detail.pin_loss_W[n] = 0;
  if (!pin.compliant()) return;
  const double pressed = pressed_m(x[kRodEnd + n] - detail.pose.length_m[n], pin.play_m);
  const double closing = x[kRodEndRate + n] - detail.pose.lever_m[n] * x[kRate + n];
  const double spring = pin.stiffness_N_per_m * pressed, damping = pin.damping_Ns_per_m * closing;
  detail.pin_N[n] = pressed > 0 ? one_sided(spring, damping) : pressed < 0 ? -one_sided(-spring, -damping) : 0;
  detail.pin_loss_W[n] = (detail.pin_N[n] - spring) * closing;
  if (detail.pin_N[n] != 0) detail.rod_damping_Ns_per_m[n] += pin.damping_Ns_per_m;
  dx[kRodEnd + n] = x[kRodEndRate + n];
  dx[kRodEndRate + n] = (rod_N - detail.pin_N[n]) / pin.mass_kg;
}

double PlantModel::pin_energy(const StateVector& x, const PoseGeometry& pose, std::size_t i) const noexcept {
  const PinTruth& pin = truth_.pin[i];
  if (!pin.compliant()) return 0;
  const auto n = static_cast<Eigen::Index>(i);
  const double pressed = pressed_m(x[kRodEnd + n] - pose.length_m[n], pin.play_m);
  return 0.5 * (pin.stiffness_N_per_m * pressed * pressed + pin.mass_kg * x[kRodEndRate + n] * x[kRodEndRate + n]);
}

HullState PlantModel::hull_state(const StateVector& x) noexcept {
  return {x[kHull], x[kHull + 1], x[kHull + 2], x[kHull + 3]};
}

HullFrame PlantModel::hull_frame(const StateVector& x) const noexcept {
  if (!hull_.compliant()) return {.turn = body_.hull(), .lift_mps2 = body_.lift_mps2()};
  const HullState s = hull_state(x);
  return {.turn = hull_.turn(s), .pin_m = hull_.pin_m(s), .pin_mps = hull_.pin_mps(s), .rate_radps = s.pitch_radps};
}

BucketMotion PlantModel::bucket_motion(const StateVector& x, const PoseGeometry& pose) const noexcept {
  const JointVector angle = x.segment<3>(kAngle), rate = x.segment<3>(kRate);
  const HullFrame hull = hull_frame(x);
  const auto at = [&](const PlanarVector& p) { return PlanarVector(hull.pin_m + hull.turn * p); };
  const auto velocity = [&](const PlanarVector& p, const PlanarVector& p_mps) {
    return PlanarVector(hull.pin_mps + hull.rate_radps * perp(hull.turn * p) + hull.turn * p_mps);
  };
  const PlanarVector pin = pose.boom_m + pose.arm_m, linkage = pose.boom_m + pose.linkage_m;
  return {.pin_m = at(pin),
          .pin_mps = velocity(pin, RigidBody::bucket_pin_rate(pose, rate)),
          .turn = hull.turn * pose.bucket,
          .rate_radps = hull.rate_radps + rate.sum(),
          .angle_rad = angle.sum() + truth_.hull_pitch_rad + x[kHull + 1],
          .linkage_m = at(linkage),
          .linkage_mps = velocity(linkage, RigidBody::linkage_rate(pose, rate))};
}

Mobility PlantModel::mobility(const PlantDetail& detail) const noexcept {
  const Turn& hull = detail.hull.turn;
  Mobility mobility;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const PlanarVector force = i < 2 ? hull.back(PlanarVector::Unit(i)) : PlanarVector(PlanarVector::Zero());
    const JointVector motion = detail.mass.solve(RigidBody::bucket_torque(detail.pose, force, i == 2 ? 1 : 0));
    const PlanarVector pin = hull * RigidBody::bucket_pin_rate(detail.pose, motion);
    mobility.col(i) << pin.x(), pin.y(), motion.sum();
  }
  return mobility;
}

/// Arm on a compliant hull: five equations, the joints' three eliminated first.
void PlantModel::accelerate(const StateVector& x, const JointVector& torque, const BucketLoad& load,
                            PlantDetail& detail, StateVector& dx) const noexcept {
  const JointVector rate = x.segment<3>(kRate), still = JointVector::Zero();
  const Turn& turn = detail.hull.turn;
  const PlanarVector up = turn.back(PlanarVector(0, 1)), lift = kGravity_mps2 * up;
  const PlanarVector& pin = hull_.from_centre_m();  // axes M
  const double w = detail.hull.rate_radps;
  const auto on_hull = [&](const ArmForces& arm) {
    return Eigen::Vector2d(up.dot(arm.force_N), arm.moment_Nm + cross(pin, arm.force_N));
  };
  const ArmForces heave = body_.inverse_dynamics(detail.pose, still, still, load, {up, 0, 0});
  const ArmForces pitch = body_.inverse_dynamics(detail.pose, still, still, load, {perp(pin), 0, 1});
  const ArmForces moving = body_.inverse_dynamics(detail.pose, rate, still, load, {lift - w * w * pin, w, 0});
  const PlanarVector first = hull_.first_kgm();
  const double cross_mass = up.dot(perp(first));
  detail.hull_coupling << heave.torque_Nm, pitch.torque_Nm;
  detail.hull_mass << on_hull(heave), on_hull(pitch);
  detail.hull_mass(0, 0) += hull_.truth().mass_kg;
  detail.hull_mass(0, 1) += cross_mass;
  detail.hull_mass(1, 0) += cross_mass;
  detail.hull_mass(1, 1) += hull_.second_kgm2();

  detail.ground = hull_.ground(hull_state(x));
  Eigen::Vector2d push(detail.ground.heave_N, detail.ground.pitch_Nm);
  if (detail.contact.weight_N > 0) {
    const PlanarVector centre_m = detail.hull.pin_m - turn * pin;
    push += Eigen::Vector2d(detail.contact.sum().y(),
                            detail.contact.bucket_Nm + cross(detail.bucket.pin_m - centre_m, detail.contact.bucket_N) +
                                cross(detail.bucket.linkage_m - centre_m, detail.contact.linkage_N));
  }
  push -= on_hull(moving);
  push -= Eigen::Vector2d(hull_.truth().mass_kg * kGravity_mps2 - w * w * up.dot(first), cross(first, lift));

  const JointVector free = detail.mass.solve(torque - moving.torque_Nm);
  Eigen::Matrix<double, 3, 2> carried;
  carried << detail.mass.solve(detail.hull_coupling.col(0)), detail.mass.solve(detail.hull_coupling.col(1));
  const Eigen::Matrix2d left = detail.hull_mass - detail.hull_coupling.transpose() * carried;
  const Eigen::Vector2d hull = left.inverse() * (push - detail.hull_coupling.transpose() * free);
  detail.acceleration = free - carried * hull;
  detail.hull.rate_radps2 = hull[1];
  detail.hull.lift_mps2 = lift + hull[0] * up + hull[1] * perp(pin) - w * w * pin;
  dx.segment<2>(kHull) = x.segment<2>(kHull + 2);
  dx.segment<2>(kHull + 2) = hull;
}

StateVector PlantModel::derivative(const StateVector& x, const HeldInputs& held, const WorldModel& world,
                                   PlantDetail& detail, Geometry geometry) const noexcept {
  StateVector dx;
  dx.segment<4 + 2 * kJoints>(kHull).setZero();  // hull and rod ends, where they do not move by themselves
  const JointVector rate = x.segment<3>(kRate);
  const JointVector joint_rad = x.segment<3>(kAngle);
  if (geometry == Geometry::kNew) {
    detail.pose = body_.pose(joint_rad);
  } else {
    RigidBody::shift(detail.pose, joint_rad - detail.joint_rad);
  }
  detail.joint_rad = joint_rad;
  detail.mass = body_.mass(detail.pose, held.load);
  detail.hull = hull_frame(x);
  rod_ends(x, detail);
  flows(x, held, detail, dx);

  JointVector torque;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    detail.pressure_force[n] = x[kHead + n] * axes_[i].head_area_m2 - x[kRod + n] * axes_[i].rod_area_m2;
    friction(x, i, detail, dx);
    const EndStop stop = end_stop(i, detail.length_m[n], detail.speed[n]);
    detail.stop_force[n] = stop.force_N;
    detail.rod_damping_Ns_per_m[n] += stop.damping_Ns_per_m;
    detail.joint_stop_torque[n] = joint_stop(i, x[kAngle + n], rate[n]);
    push_link(x, i, detail, dx);
    torque[n] = detail.pose.lever_m[n] * detail.pin_N[n] + detail.joint_stop_torque[n];
  }
  if (!world.empty() || held.pull_N != PlanarVector::Zero()) {
    const Turn& hull = detail.hull.turn;
    detail.bucket = bucket_motion(x, detail.pose);
    detail.contact = world.forces(detail.bucket);
    detail.contact.on_bucket(nullptr, detail.bucket, detail.bucket.at(held.pull_at_m), hull * held.pull_N);
    torque += RigidBody::bucket_torque(detail.pose, hull.back(detail.contact.bucket_N), detail.contact.bucket_Nm) +
              RigidBody::linkage_torque(detail.pose, hull.back(detail.contact.linkage_N));
  } else {
    detail.contact = {};
  }

  if (hull_.compliant()) {
    accelerate(x, torque, held.load, detail, dx);
  } else {
    detail.acceleration = detail.mass.solve(torque - body_.bias(detail.pose, rate, held.load));
  }
  dx.segment<3>(kAngle) = rate;
  dx.segment<3>(kRate) = detail.acceleration;
  return dx;
}

void PlantModel::warm(double warmth_K) noexcept {
  if (truth_.warm_up.rise_K == 0) return;
  thinner_ = std::exp(kThinning_1pK * warmth_K);
  viscosity_ = truth_.viscosity_factor / thinner_;
  for (std::size_t i = 0; i < kJoints; ++i) bristles_[i].viscous = truth_.friction[i].viscous_Ns_per_m * viscosity_;
}

double PlantModel::settle(const StateVector& x, double dt) noexcept {
  return hull_.compliant() ? hull_.settle(hull_state(x), dt) : 0;
}

double PlantModel::mechanical_energy(const StateVector& x, const PlantDetail& detail,
                                     const BucketLoad& load) const noexcept {
  const JointVector rate = x.segment<3>(kRate);
  double energy = detail.mass.kinetic_energy(rate);
  if (!hull_.compliant()) return energy + body_.potential_energy(detail.pose, load, body_.lift_mps2());
  const Eigen::Vector2d hull = x.segment<2>(kHull + 2);
  const Turn& turn = detail.hull.turn;
  energy += rate.dot(detail.hull_coupling * hull) + 0.5 * hull.dot(detail.hull_mass * hull) + detail.ground.stored_J;
  energy += body_.potential_energy(detail.pose, load, kGravity_mps2 * turn.back(PlanarVector(0, 1)));
  const double own_height = (turn * hull_.first_kgm()).y() + hull_.truth().mass_kg * x[kHull];
  return energy + kGravity_mps2 * (own_height + body_.arm_mass_kg(detail.pose, load) * detail.hull.pin_m.y());
}

StateVector PlantModel::equilibrium(const JointVector& joint_rad, const BucketLoad& load) {
  StateVector x = StateVector::Zero();
  x.segment<3>(kAngle) = joint_rad;
  const PoseGeometry pose = body_.pose(joint_rad);
  const JointVector hold = body_.bias(pose, JointVector::Zero(), load);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    constexpr double kReach_m = 0.01;
    if (!(pose.length_m[n] > axes_[i].min_length_m - kReach_m && pose.length_m[n] < axes_[i].max_length_m + kReach_m)) {
      std::ostringstream line;
      line << truth_.machine.source << ": start of " << kJointNames[i] << " = " << joint_rad[n]
           << " rad: needs cylinder " << pose.length_m[n] << " m, must be " << axes_[i].min_length_m << ".."
           << axes_[i].max_length_m << " m";
      throw InputError(line.str());
    }
    const double force = hold[n] / pose.lever_m[n];
    const double rod =
        std::max(kRestPressure_Pa, (kRestPressure_Pa * axes_[i].head_area_m2 - force) / axes_[i].rod_area_m2);
    x[kRod + n] = rod;
    x[kHead + n] = (force + rod * axes_[i].rod_area_m2) / axes_[i].head_area_m2;
    if (const PinTruth& pin = truth_.pin[i]; pin.compliant()) {
      const double slack = force == 0 ? 0 : std::copysign(0.5 * pin.play_m, force);
      x[kRodEnd + n] = pose.length_m[n] + slack + force / pin.stiffness_N_per_m;
    }
  }
  if (hull_.compliant()) {
    const PlanarVector lift = body_.lift_mps2();
    const JointVector still = JointVector::Zero();
    const ArmForces arm = body_.inverse_dynamics(pose, still, still, load, {lift, 0, 0});
    hull_.stand((body_.hull() * arm.force_N).y() + hull_.truth().mass_kg * kGravity_mps2,
                arm.moment_Nm + cross(hull_.from_centre_m(), arm.force_N) + cross(hull_.first_kgm(), lift),
                truth_.machine.source);
  }
  const HydraulicsDescription& h = truth_.machine.hydraulics;
  x[kPump] = x[kSense] = h.tank_Pa + h.load_sensing_margin_Pa;
  return x;
}

}  // namespace knuckle::sim
