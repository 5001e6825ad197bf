#include "sim/plant_model.h"

#include <algorithm>
#include <cmath>
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
constexpr double kRestPressure_Pa = 10e5;  // in the side of a cylinder that does not carry

/// Damping that acts only while closing in, so that a stop never pulls.
double one_sided(double push, double damping) noexcept {
  return std::max(0.0, push + damping);
}

}  // namespace

PlantModel::PlantModel(const MachineTruth& truth) : truth_(truth), body_(truth.machine, truth.hull_pitch_rad) {
  check_truth(truth);
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
                    f.viscous_Ns_per_m * truth.viscosity_factor};
  }
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
    asked += axes_[i].valve_gain * std::abs(o) * orifice(std::max(0.0, x[kSense] - load));
  }
  return asked;
}

double PlantModel::end_stop(std::size_t i, double length, double speed) const noexcept {
  const double in = length - axes_[i].min_length_m, out = axes_[i].max_length_m - length;
  if (in > kCushion_m && out > kCushion_m) return 0;
  // sign: force on the rod, positive = extending
  const bool retracting_end = in < out;
  const double gap = retracting_end ? in : out;
  const double closing = retracting_end ? -speed : speed;
  const double part = std::clamp(1 - gap / kCushion_m, 0.0, 1.0);
  const double cushion = kCushion_Ns_per_m * part * part * std::max(0.0, closing);
  const double stop = gap < 0 ? one_sided(-kEndStop_N_per_m * gap, kEndStop_Ns_per_m * closing) : 0;
  return retracting_end ? cushion + stop : -(cushion + stop);
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
  // |v| sigma0 z / g(v) with g = F_c (1 + rise / u): the part of v that the bristles let go
  const double slip = std::abs(v) * c.stiffness * z * u / ((v >= 0 ? c.extend_N : c.retract_N) * (u + c.rise));
  const double z_rate = v - slip;
  const double damping = c.damping * fade;
  detail.friction[n] = c.stiffness * z + damping * z_rate + c.viscous * v;
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
      const double gain = axes_[i].valve_gain * std::abs(o);
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
    const double v = detail.speed[n];
    const double length = detail.pose.length_m[n];
    const double rate_a =
        oil_.pressure_rate(pa, qa + suck_a - axes_[i].head_area_m2 * v - x[kHeadRelief + n], head_volume(i, length));
    const double rate_b =
        oil_.pressure_rate(pb, qb + suck_b + axes_[i].rod_area_m2 * v - x[kRodRelief + n], rod_volume(i, length));
    dx[kHead + n] = pa <= kVapour_Pa ? std::max(0.0, rate_a) : rate_a;
    dx[kRod + n] = pb <= kVapour_Pa ? std::max(0.0, rate_b) : rate_b;
    dx[kHeadRelief + n] =
        (relief_gain_ * std::max(0.0, pa - h.port_relief_Pa) - x[kHeadRelief + n]) * (1 / kReliefLag_s);
    dx[kRodRelief + n] = (relief_gain_ * std::max(0.0, pb - h.port_relief_Pa) - x[kRodRelief + n]) * (1 / kReliefLag_s);
    detail.feed[i] = feed;
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
  dx[kSense] = (target - x[kSense]) / h.load_sensing_lag_s;
}

StateVector PlantModel::derivative(const StateVector& x, const HeldInputs& held, const WorldModel& world,
                                   PlantDetail& detail) const noexcept {
  StateVector dx;
  dx[kStates] = 0;
  const JointVector rate = x.segment<3>(kRate);
  detail.pose = body_.pose(x.segment<3>(kAngle));
  detail.speed = detail.pose.lever_m.cwiseProduct(rate);
  flows(x, held, detail, dx);

  JointVector torque;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto n = static_cast<Eigen::Index>(i);
    friction(x, i, detail, dx);
    detail.pressure_force[n] = x[kHead + n] * axes_[i].head_area_m2 - x[kRod + n] * axes_[i].rod_area_m2;
    detail.stop_force[n] = end_stop(i, detail.pose.length_m[n], detail.speed[n]);
    detail.joint_stop_torque[n] = joint_stop(i, x[kAngle + n], rate[n]);
    torque[n] = detail.pose.lever_m[n] * (detail.pressure_force[n] - detail.friction[n] + detail.stop_force[n]) +
                detail.joint_stop_torque[n];
  }
  detail.tip = RigidBody::tip(detail.pose);
  detail.tip_rate = RigidBody::tip_rate(detail.pose, rate);
  detail.contact = world.forces(body_.hull() * detail.tip, body_.hull() * detail.tip_rate);
  detail.tip_force = body_.hull().back(detail.contact.sum()) + held.tip_load_N;
  torque += RigidBody::tip_torque(detail.pose, detail.tip_force);

  detail.mass = body_.mass(detail.pose, held.load);
  detail.acceleration = detail.mass.solve(torque - body_.bias(detail.pose, rate, held.load));
  dx.segment<3>(kAngle) = rate;
  dx.segment<3>(kRate) = detail.acceleration;
  return dx;
}

StateVector PlantModel::equilibrium(const JointVector& joint_rad, const BucketLoad& load) const {
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
  }
  const HydraulicsDescription& h = truth_.machine.hydraulics;
  x[kPump] = x[kSense] = h.tank_Pa + h.load_sensing_margin_Pa;
  return x;
}

}  // namespace knuckle::sim
