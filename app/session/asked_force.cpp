#include "app/session/asked_force.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "app/session/scenario.h"
#include "machine/kinematics.h"
#include "sim/rigid_body.h"

namespace knuckle::session {
namespace {

/// Of a free arm at the part of the bucket that is foremost along the press.
double moved_mass_kg(const MachineDescription& machine, const JointVector& joint_rad, const PlanarVector& along) {
  const auto outline = bucket_outline(machine);
  const Eigen::Rotation2Dd turn(joint_rad.sum());
  const PlanarVector foremost = turn * *std::ranges::max_element(outline, {}, [&](const PlanarVector& corner) {
                                  return along.dot(turn * corner);
                                });
  const sim::RigidBody body(machine, 0);
  const sim::PoseGeometry pose = body.pose(joint_rad);
  const JointVector torque = sim::RigidBody::bucket_torque(pose, along, cross(foremost, along));
  return 1 / torque.dot(body.mass(pose, {}).solve(torque));
}

/// 0 where nothing faces the press, or what does is no linear spring.
double pressed_stiffness_N_per_m(const sim::WorldDescription& world, const PlanarVector& along) {
  double facing = 0.5, stiffness = 0;  // within 60 deg
  const auto consider = [&](const PlanarVector& normal, double stiffness_N_per_m) {
    const double faces = -along.dot(normal.normalized());
    if (faces > facing) {
      facing = faces;
      stiffness = stiffness_N_per_m;
    }
  };
  for (const sim::WallDescription& wall : world.walls) {
    consider(wall.normal, wall.hunt_crossley_N_per_m15 > 0 ? 0 : wall.stiffness_N_per_m);
  }
  if (world.ground) consider(PlanarVector(0, 1), world.ground->stiffness_N_per_m);
  return stiffness;
}

}  // namespace

std::vector<double> asked_forces_N(const MachineDescription& machine, const Scenario& scenario, double force_scale) {
  const Kinematics kinematics(machine);
  JointVector joint_rad = scenario.start_rad;
  std::vector<double> asked_N;
  for (const sim::Phase& phase : scenario.phases) {
    asked_N.push_back(0);
    if (phase.kind == sim::PhaseKind::kMove) {
      joint_rad =
          phase.joint_space ? phase.joints_rad : kinematics.inverse(phase.tip_m, phase.bucket_rad).value_or(joint_rad);
    }
    if (phase.kind != sim::PhaseKind::kPress || phase.until_break) continue;
    const double stiffness = pressed_stiffness_N_per_m(scenario.world, phase.direction);
    if (stiffness <= 0) continue;
    const double impact_N = phase.speed_mps * std::sqrt(stiffness * moved_mass_kg(machine, joint_rad, phase.direction));
    asked_N.back() = phase.force_N / force_scale + impact_N;
  }
  return asked_N;
}

}  // namespace knuckle::session
