#include "app/console/joint_load.h"

#include <algorithm>
#include <cmath>

#include "estimation/friction.h"
#include "estimation/length_error.h"
#include "estimation/regressor.h"

namespace knuckle::console {
namespace {

constexpr double kReliefShare = 0.97;
constexpr double kHullSlope_rad = 0.1;  // the operator's side is not told how the hull stands
constexpr double kModelShare = 0.15;    // of the weight's torque, by which a drawing may be wrong
constexpr double kLeastReach_m = 0.2;
constexpr double kAngleError_rad = 0.009;  // half a degree: as well as joints are measured
constexpr double kMoves_mps = 0.02;        // of a rod that goes on
constexpr double kRest_mps = 0.012;        // of one that stands: two steps of its encoder at once are seen as 0.011

/// What the weight of arm and load may be, joint by joint.
struct Weight {
  JointVector least_Nm, most_Nm;
};

Weight weight_of(const SlaveMessage& m, const MachineDescription& machine, const Kinematics& kinematics) {
  const estimation::BaseParameters parameters = estimation::known_parameters(machine);
  const auto arm_Nm = [&](double slope_rad) {
    return JointVector(estimation::joint_torque(
        estimation::RigidArm::gravity(estimation::Pose(m.position_rad, slope_rad)) * parameters));
  };
  const JointVector level_Nm = arm_Nm(0), up_Nm = arm_Nm(kHullSlope_rad), down_Nm = arm_Nm(-kHullSlope_rad);
  const JointVector unsure_Nm = kModelShare * level_Nm.cwiseAbs();
  // A load that is not known may be anything from none to a full bucket.
  const double full_kg = machine.payload_full_scale_kg;
  const auto load_kg = [&](double sigmas) {
    const double kg = m.payload_kg + sigmas * m.payload_sigma_kg;
    return std::isfinite(kg) ? std::clamp(kg, 0.0, full_kg) : sigmas > 0 ? full_kg : 0.0;
  };
  const JointVector per_kg_Nm = estimation::kGravity_mps2 * kinematics.tip_jacobian(m.position_rad).row(1).transpose();
  const JointVector light_Nm = load_kg(-2) * per_kg_Nm, heavy_Nm = load_kg(2) * per_kg_Nm;
  return {up_Nm.cwiseMin(down_Nm) - unsure_Nm + light_Nm.cwiseMin(heavy_Nm),
          up_Nm.cwiseMax(down_Nm) + unsure_Nm + light_Nm.cwiseMax(heavy_Nm)};
}

/// From each joint to the farthest place that it may press with: a corner of the bucket, its linkage, the arm's pin.
JointVector reaches_m(const MachineDescription& machine, const JointVector& joints_rad) {
  const MachinePose pose = pose_of(machine, joints_rad);
  const PerJoint<PlanarVector> origins_m{pose.boom.translation(), pose.arm.translation(), pose.bucket.translation()};
  JointVector reaches_m = JointVector::Constant(kLeastReach_m);
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto reach_out = [&, origin_m = origins_m[static_cast<std::size_t>(joint)]](const PlanarVector& place_m) {
      reaches_m[joint] = std::max(reaches_m[joint], (place_m - origin_m).norm());
    };
    for (const PlanarVector& corner : bucket_outline(machine)) reach_out(pose.bucket * corner);
    reach_out(pose.linkage_pin_m);
    if (joint == kBoom) reach_out(origins_m[kArm]);
  }
  return reaches_m;
}

/// One joint's oil against the weight that it may have to carry.
struct Push {
  int way = 0;
  double beyond_Nm = 0;
};
Push push_of(double oil_Nm, double least_Nm, double most_Nm, double friction_Nm, double worth_Nm) {
  // Where the oil itself does not push that way, it is the weight that rests on something.
  const double up_Nm = oil_Nm - most_Nm - friction_Nm, down_Nm = least_Nm - friction_Nm - oil_Nm;
  if (oil_Nm > 0 && up_Nm > worth_Nm) return {1, up_Nm};
  if (oil_Nm < 0 && down_Nm > worth_Nm) return {-1, down_Nm};
  return {};
}

/// What one joint's rod does.
struct Rod {
  double lever_m, out_mps;
  double head_Pa, rod_Pa, oil_N;
};
Rod rod_of(const SlaveMessage& m, const CylinderDescription& cylinder, const CylinderState& at, int joint) {
  const auto i = static_cast<std::size_t>(joint);
  const double head_Pa = m.pressure_Pa[2 * i], rod_Pa = m.pressure_Pa[2 * i + 1];
  return {at.lever_m, at.lever_m * m.velocity_radps[joint], head_Pa, rod_Pa,
          head_Pa * cylinder.head_area_m2() - rod_Pa * cylinder.rod_side_area_m2()};
}

/// @param weight of all joints, @param load with its reach.
void add_push(const Rod& rod, const MachineDescription& machine, int joint, const Weight& weight, JointLoad& load) {
  const estimation::CylinderFriction friction = estimation::known_friction(machine, joint);
  const double friction_N =
      friction.static_N(rod.oil_N, rod.head_Pa + rod.rod_Pa) + std::abs(friction.viscous_Ns_per_m * rod.out_mps);
  const Push push = push_of(rod.lever_m * (rod.oil_N - friction.offset_N), weight.least_Nm[joint],
                            weight.most_Nm[joint], std::abs(rod.lever_m) * friction_N, kWorthSaying_N * load.reach_m);
  const bool extends = (push.way > 0) == (rod.lever_m > 0);
  // Oil that slows a joint down presses on nothing.
  if (push.way == 0 || (extends ? rod.out_mps : -rod.out_mps) < -kMoves_mps) return;
  load.pushes = push.way;
  load.beyond_Nm = push.beyond_Nm;
  load.pressure_Pa = extends ? rod.head_Pa : rod.rod_Pa;
  load.at_relief = at_relief(machine.hydraulics, load.pressure_Pa);
}

}  // namespace

int end_of_range(const MachineDescription& machine, std::size_t joint, double angle_rad, double error_rad) noexcept {
  const LinkDescription& link = machine.links[joint];
  const double near_rad = machine.limits.joint_soft_margin_rad + error_rad;
  return angle_rad > link.max_rad - near_rad ? 1 : angle_rad < link.min_rad + near_rad ? -1 : 0;
}

bool at_relief(const HydraulicsDescription& hydraulics, double pressure_Pa) noexcept {
  return pressure_Pa >= kReliefShare * std::min(hydraulics.main_relief_Pa, hydraulics.port_relief_Pa);
}

JointLoads joint_loads(const SlaveMessage& m, const MachineDescription& machine, const Kinematics& kinematics) {
  JointLoads loads;
  if (!m.position_rad.allFinite()) return loads;
  const Weight weight = weight_of(m, machine, kinematics);
  const JointVector reach_m = reaches_m(machine, m.position_rad);
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto i = static_cast<std::size_t>(joint);
    const LinkDescription& link = machine.links[i];
    const double angle_rad = m.position_rad[joint];
    JointLoad& load = loads[i];
    load.end = end_of_range(machine, i, angle_rad, kAngleError_rad);
    load.reach_m = reach_m[joint];
    const auto at = kinematics.cylinder_at(joint, angle_rad);
    if (!at) continue;
    const Rod rod = rod_of(m, machine.cylinders[i], *at, joint);
    load.at_rest = std::abs(rod.out_mps) < kRest_mps;
    if ((m.unknown_torques >> joint & 1) == 0) add_push(rod, machine, joint, weight, load);
    if (estimation::to_steel_m(link, machine.cylinders[i], *at, angle_rad) >=
        estimation::steel_spread_m(machine.geometry_calibration.has_value()))
      continue;
    // The steel may be here already: it is where the joint is led to that end, or pushed towards it, and gets no
    // farther.
    const int side = angle_rad - link.min_rad > link.max_rad - angle_rad ? 1 : -1;
    load.at_steel = side;
    const bool led = end_of_range(machine, i, angle_rad + m.ahead_rad[joint], kAngleError_rad) == side;
    if (led || (load.pushes == side && std::abs(rod.out_mps) < kMoves_mps)) load.end = side;
  }
  return loads;
}

void PushWatch::watch(JointLoads& loads, Time now) noexcept {
  const bool at_rest = std::all_of(loads.begin(), loads.end(), [](const JointLoad& load) { return load.at_rest; });
  // What was between two looks is not known where another session has begun, or nobody has looked for too long.
  const bool anew = now < seen_ || now - seen_ > kLasts;
  const auto pushed_for = [&](Push& push, int way, Duration time) {
    if (anew || way != push.way) push = {way, now};
    return way != 0 && now - push.since >= time;
  };
  for (std::size_t i = 0; i < kJoints; ++i) {
    JointLoad& load = loads[i];
    load.steady = pushed_for(pushes_[i], load.pushes, kSteady);
    load.lasts = pushed_for(at_rest_[i], at_rest ? load.pushes : 0, kLasts);
  }
  seen_ = now;
}

}  // namespace knuckle::console
