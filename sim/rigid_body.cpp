#include "sim/rigid_body.h"

#include <cmath>

namespace knuckle::sim {
namespace {

constexpr double kGravity = 9.80665;

struct LumpForce {
  PlanarVector force;  ///< In M.
  double moment;       ///< About the link's origin.
};

/// Inertial force and moment of a lump whose link turns with w and whose origin accelerates by a, accelerations of the
/// joints left out; `turn` brings link axes to M.
LumpForce velocity_terms(const Lump& lump, const Turn& turn, const PlanarVector& a, double w, double s_rate) noexcept {
  const PlanarVector first = turn * lump.first;
  const PlanarVector in_link = 2 * w * s_rate * perp(lump.first1) + s_rate * s_rate * lump.first2;
  return {lump.mass * a - w * w * first + turn * in_link,
          cross(first, a) + lump.second1 * s_rate * w + lump.mixed1 * s_rate * s_rate};
}

/// Generalised force of the lump's own motion s, accelerations of the joints left out (Lagrange).
double own_velocity_terms(const Lump& lump, const Turn& turn, const PlanarVector& a, double w, double s_rate) noexcept {
  return 0.5 * lump.own1 * s_rate * s_rate - 0.5 * lump.second1 * w * w + (turn * lump.first1).dot(a);
}

}  // namespace

JointVector MassMatrix::solve(const JointVector& b) const noexcept {
  const double d0 = 1 / m00;
  const double l10 = m01 * d0, l20 = m02 * d0;
  const double d1 = 1 / (m11 - l10 * m01);
  const double u12 = m12 - l10 * m02;
  const double l21 = u12 * d1;
  const double d2 = 1 / (m22 - l20 * m02 - l21 * u12);
  const double y1 = b[1] - l10 * b[0];
  const double y2 = b[2] - l20 * b[0] - l21 * y1;
  const double x2 = y2 * d2;
  const double x1 = y1 * d1 - l21 * x2;
  return {b[0] * d0 - l10 * x1 - l20 * x2, x1, x2};
}

double MassMatrix::kinetic_energy(const JointVector& v) const noexcept {
  return 0.5 * (m00 * v[0] * v[0] + m11 * v[1] * v[1] + m22 * v[2] * v[2]) + m01 * v[0] * v[1] + m02 * v[0] * v[2] +
         m12 * v[1] * v[2];
}

RigidBody::RigidBody(const MachineDescription& machine, double hull_pitch_rad)
    : machine_(machine),
      hull_(hull_pitch_rad),
      lift_(kGravity * PlanarVector(std::sin(hull_pitch_rad), std::cos(hull_pitch_rad))) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[i];
    links_[i].add(link.mass_kg, link.inertia_kgm2, {link.com_m, PlanarVector::Zero(), PlanarVector::Zero()}, 0, 0);
    // Tube and rod fill the retracted cylinder but for the eyes.
    const CylinderDescription& cylinder = machine.cylinders[i];
    const double reach = 0.9 * cylinder.min_length_m;
    rods_[i] = {cylinder.body_mass_kg,
                cylinder.rod_mass_kg,
                cylinder.body_mass_kg * reach * reach / 12,
                cylinder.rod_mass_kg * reach * reach / 12,
                reach / 2,
                reach / 2};
  }
}

void RigidBody::add_cylinder(Lump& lump, std::size_t joint, const PlanarVector& fixed, const MovingPoint& moving,
                             const PinLine& line) const noexcept {
  const RodPair& rods = rods_[joint];
  const PlanarVector across = perp(line.along);
  const MovingPoint direction{line.along, line.turn1 * across,
                              line.turn2 * across - line.turn1 * line.turn1 * line.along};
  const MovingPoint body{fixed + rods.body_centre * direction.p, rods.body_centre * direction.d1,
                         rods.body_centre * direction.d2};
  const MovingPoint rod{moving.p - rods.rod_centre * direction.p, moving.d1 - rods.rod_centre * direction.d1,
                        moving.d2 - rods.rod_centre * direction.d2};
  lump.add(rods.body_mass, rods.body_inertia, body, line.turn1, line.turn2);
  lump.add(rods.rod_mass, rods.rod_inertia, rod, line.turn1, line.turn2);
}

void RigidBody::add_linkage_rods(Lump& lump, const FourBar& bars) const noexcept {
  const BucketLinkage& linkage = machine_.bucket_linkage;
  const PlanarVector rocker = bars.h.p - linkage.rocker_pin_m;
  const double a2 = linkage.rocker_length_m * linkage.rocker_length_m;
  lump.add(linkage.rocker_mass_kg, linkage.rocker_mass_kg * a2 / 12,
           {0.5 * (linkage.rocker_pin_m + bars.h.p), 0.5 * bars.h.d1, 0.5 * bars.h.d2}, cross(rocker, bars.h.d1) / a2,
           cross(rocker, bars.h.d2) / a2);
  const PlanarVector coupler = bars.k.p - bars.h.p;
  const double b2 = linkage.coupler_length_m * linkage.coupler_length_m;
  lump.add(linkage.coupler_mass_kg, linkage.coupler_mass_kg * b2 / 12,
           {0.5 * (bars.k.p + bars.h.p), 0.5 * (bars.k.d1 + bars.h.d1), 0.5 * (bars.k.d2 + bars.h.d2)},
           cross(coupler, bars.k.d1 - bars.h.d1) / b2, cross(coupler, bars.k.d2 - bars.h.d2) / b2);
}

PoseGeometry RigidBody::pose(const JointVector& joint_rad) const noexcept {
  const Turn q0(joint_rad[0]), q1(joint_rad[1]), q2(joint_rad[2]);
  PoseGeometry pose;
  pose.boom = q0;
  pose.arm = q0 * q1;
  pose.bucket = pose.arm * q2;
  const double l0 = machine_.links[kBoom].length_m, l1 = machine_.links[kArm].length_m;
  pose.boom_m = l0 * PlanarVector(pose.boom.c, pose.boom.s);
  pose.arm_m = l1 * PlanarVector(pose.arm.c, pose.arm.s);
  pose.bucket_m = machine_.links[kBucket].length_m * PlanarVector(pose.bucket.c, pose.bucket.s);

  const MovingPoint boom_pin = turning_pin(PlanarVector::Zero(), q0, machine_.boom_mount.child_pin_m);
  const PinLine boom = pin_line(machine_.boom_mount.parent_pin_m, boom_pin);
  add_cylinder(pose.on_hull, kBoom, machine_.boom_mount.parent_pin_m, boom_pin, boom);

  const MovingPoint arm_pin = turning_pin({l0, 0}, q1, machine_.arm_mount.child_pin_m);
  const PinLine arm = pin_line(machine_.arm_mount.parent_pin_m, arm_pin);
  pose.on_boom = links_[kBoom];
  add_cylinder(pose.on_boom, kArm, machine_.arm_mount.parent_pin_m, arm_pin, arm);

  const BucketLinkage& linkage = machine_.bucket_linkage;
  const FourBar bars = four_bar(linkage, turning_pin({l1, 0}, q2, linkage.bucket_pin_m));
  const PinLine bucket = pin_line(linkage.cylinder_pin_m, bars.h);
  pose.on_arm = links_[kArm];
  add_cylinder(pose.on_arm, kBucket, linkage.cylinder_pin_m, bars.h, bucket);
  add_linkage_rods(pose.on_arm, bars);

  pose.length_m = {boom.length_m, arm.length_m, bucket.length_m};
  pose.lever_m = {boom.lever_m, arm.lever_m, bucket.lever_m};
  return pose;
}

MassMatrix RigidBody::mass(const PoseGeometry& pose, const BucketLoad& load) const noexcept {
  const Lump& bucket = links_[kBucket];
  const double bucket_mass = bucket.mass + load.mass_kg;
  const PlanarVector bucket_first = pose.bucket * (bucket.first + load.first_kgm);
  const PlanarVector arm_first = pose.arm * pose.on_arm.first;
  const PlanarVector &e = pose.boom_m, &d = pose.arm_m;
  // By absolute link angles ...
  const double a00 = pose.on_boom.second + (pose.on_arm.mass + bucket_mass) * e.squaredNorm();
  const double a11 = pose.on_arm.second + bucket_mass * d.squaredNorm();
  const double a22 = bucket.second + load.second_kgm2;
  const double a01 = e.dot(arm_first + bucket_mass * d);
  const double a02 = e.dot(bucket_first);
  const double a12 = d.dot(bucket_first);
  // ... then by joint angles, with what moves along its link.
  const double slide_boom = pose.on_boom.mixed;
  const double slide_arm = pose.on_arm.mixed + cross(e, pose.arm * pose.on_arm.first1);
  const double tail = a22 + a12;
  const double arm_tail = a11 + a12 + tail;
  MassMatrix m;
  m.m00 = a00 + arm_tail + 2 * (a01 + a02) + pose.on_hull.own;
  m.m01 = arm_tail + a01 + a02 + slide_boom;
  m.m02 = tail + a02 + slide_arm;
  m.m11 = arm_tail + pose.on_boom.own;
  m.m12 = tail + pose.on_arm.mixed;
  m.m22 = a22 + pose.on_arm.own;
  return m;
}

JointVector RigidBody::bias(const PoseGeometry& pose, const JointVector& rate, const BucketLoad& load) const noexcept {
  const double w0 = rate[0], w1 = w0 + rate[1], w2 = w1 + rate[2];
  const PlanarVector &e = pose.boom_m, &d = pose.arm_m;
  const PlanarVector elbow = lift_ - w0 * w0 * e;
  const PlanarVector wrist = elbow - w1 * w1 * d;

  const Lump& link = links_[kBucket];
  const PlanarVector bucket_first = pose.bucket * (link.first + load.first_kgm);
  const PlanarVector bucket_force = (link.mass + load.mass_kg) * wrist - w2 * w2 * bucket_first;
  const double bucket_moment = cross(bucket_first, wrist);

  const LumpForce arm = velocity_terms(pose.on_arm, pose.arm, elbow, w1, rate[2]);
  const LumpForce boom = velocity_terms(pose.on_boom, pose.boom, lift_, w0, rate[1]);
  const double about_elbow = bucket_moment + cross(d, bucket_force) + arm.moment;
  const double about_boom_pin = about_elbow + cross(e, bucket_force + arm.force) + boom.moment;
  return {about_boom_pin + own_velocity_terms(pose.on_hull, Turn(), lift_, 0, w0),
          about_elbow + own_velocity_terms(pose.on_boom, pose.boom, lift_, w0, rate[1]),
          bucket_moment + own_velocity_terms(pose.on_arm, pose.arm, elbow, w1, rate[2])};
}

double RigidBody::potential_energy(const PoseGeometry& pose, const BucketLoad& load) const noexcept {
  const Lump& bucket = links_[kBucket];
  const PlanarVector first = pose.on_hull.first + pose.boom * pose.on_boom.first + pose.on_arm.mass * pose.boom_m +
                             pose.arm * pose.on_arm.first + (bucket.mass + load.mass_kg) * (pose.boom_m + pose.arm_m) +
                             pose.bucket * (bucket.first + load.first_kgm);
  return lift_.dot(first);
}

PlanarVector RigidBody::tip_rate(const PoseGeometry& pose, const JointVector& rate) noexcept {
  const double w0 = rate[0], w1 = w0 + rate[1], w2 = w1 + rate[2];
  return perp(w0 * pose.boom_m + w1 * pose.arm_m + w2 * pose.bucket_m);
}

JointVector RigidBody::tip_torque(const PoseGeometry& pose, const PlanarVector& force) noexcept {
  const double bucket = cross(pose.bucket_m, force);
  const double arm = bucket + cross(pose.arm_m, force);
  return {arm + cross(pose.boom_m, force), arm, bucket};
}

}  // namespace knuckle::sim
