#include "sim/rigid_body.h"

#include <cmath>

namespace knuckle::sim {
namespace {

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

/// Of a lump's link: absolute rate and acceleration, and those of the lump's own motion s.
struct LumpMotion {
  double w, a, s_rate, s_acceleration;
};
struct FullLumpForce {
  PlanarVector force;
  double moment, own;
};

/// velocity_terms() and own_velocity_terms() with all accelerations (Lagrange).
FullLumpForce lump_force(const Lump& lump, const Turn& turn, const PlanarVector& a, const LumpMotion& m) noexcept {
  const LumpForce slow = velocity_terms(lump, turn, a, m.w, m.s_rate);
  const double own = own_velocity_terms(lump, turn, a, m.w, m.s_rate);
  return {slow.force + m.a * perp(turn * lump.first) + m.s_acceleration * (turn * lump.first1),
          slow.moment + m.a * lump.second + m.s_acceleration * lump.mixed,
          own + m.s_acceleration * lump.own + m.a * lump.mixed};
}

}  // namespace

JointVector MassMatrix::solve(const JointVector& b) const noexcept {
  const double c00 = m11 * m22 - m12 * m12, c01 = m02 * m12 - m01 * m22, c02 = m01 * m12 - m02 * m11;
  const double c11 = m00 * m22 - m02 * m02, c12 = m01 * m02 - m00 * m12, c22 = m00 * m11 - m01 * m01;
  const double inverse = 1 / (m00 * c00 + m01 * c01 + m02 * c02);
  return {inverse * (c00 * b[0] + c01 * b[1] + c02 * b[2]), inverse * (c01 * b[0] + c11 * b[1] + c12 * b[2]),
          inverse * (c02 * b[0] + c12 * b[1] + c22 * b[2])};
}

double MassMatrix::kinetic_energy(const JointVector& v) const noexcept {
  return 0.5 * (m00 * v[0] * v[0] + m11 * v[1] * v[1] + m22 * v[2] * v[2]) + m01 * v[0] * v[1] + m02 * v[0] * v[2] +
         m12 * v[1] * v[2];
}

RigidBody::RigidBody(const MachineDescription& machine, double hull_pitch_rad)
    : machine_(machine),
      hull_(hull_pitch_rad),
      lift_(kGravity_mps2 * PlanarVector(std::sin(hull_pitch_rad), std::cos(hull_pitch_rad))) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[i];
    links_[i].add_fixed(link.mass_kg, link.inertia_kgm2, link.com_m);
    // Tube and rod fill the retracted cylinder but for the eyes.
    const CylinderDescription& cylinder = machine.cylinders[i];
    const double reach = 0.9 * cylinder.min_length_m;
    rods_[i] = {cylinder.body_mass_kg + cylinder.rod_mass_kg, cylinder.body_mass_kg * reach / 2, cylinder.rod_mass_kg,
                reach / 2, cylinder.body_mass_kg * reach * reach / 3 + cylinder.rod_mass_kg * reach * reach / 12};
  }
  // The coupler's mass sits half at each of its pins.
  links_[kBucket].add_fixed(machine.bucket_linkage.coupler_mass_kg / 2, 0, machine.bucket_linkage.bucket_pin_m);
}

void RigidBody::add_cylinder(Lump& lump, const RodPair& rods, const PlanarVector& fixed, const MovingPoint& moving,
                             const PinLine& line) noexcept {
  // About the fixed pin: the body turns, the rod turns and slides (rho: its centre's distance from that pin).
  const double turn = line.turn1, turn2 = line.turn2;
  const double rho = line.length_m - rods.rod_centre, rho1 = line.lever_m;
  const double rho2 = line.along.dot(moving.d2) + line.length_m * turn * turn;
  const double polar = rods.turning + rods.rod_mass * rho * rho, polar1 = 2 * rods.rod_mass * rho * rho1;
  lump.own += polar * turn * turn + rods.rod_mass * rho1 * rho1;
  lump.own1 += polar1 * turn * turn + 2 * (polar * turn * turn2 + rods.rod_mass * rho1 * rho2);

  const double first = rods.body_first + rods.rod_mass * rho;
  const double first1 = rods.rod_mass * rho1, first2 = rods.rod_mass * rho2;
  const double across1 = first * turn, along2 = first2 - first * turn * turn,
               across2 = 2 * first1 * turn + first * turn2;
  const double ux = line.along.x(), uz = line.along.y();
  const PlanarVector f1(first1 * ux - across1 * uz, first1 * uz + across1 * ux);
  const PlanarVector f2(along2 * ux - across2 * uz, along2 * uz + across2 * ux);
  lump.mass += rods.mass;
  lump.first += rods.mass * fixed + first * line.along;
  lump.first1 += f1;
  lump.first2 += f2;
  lump.second += polar + rods.mass * fixed.squaredNorm() + 2 * first * fixed.dot(line.along);
  lump.second1 += polar1 + 2 * fixed.dot(f1);
  lump.mixed += polar * turn + cross(fixed, f1);
  lump.mixed1 += polar1 * turn + polar * turn2 + cross(fixed, f2);
}

void RigidBody::add_rocker(Lump& lump, const FourBar& bars) const noexcept {
  const BucketLinkage& linkage = machine_.bucket_linkage;
  const PlanarVector& pin = linkage.rocker_pin_m;
  const double end_mass = linkage.coupler_mass_kg / 2;
  const double mass = linkage.rocker_mass_kg + end_mass;
  const double first = linkage.rocker_mass_kg / 2 + end_mass;  // times the rocker as a vector
  const double polar = (linkage.rocker_mass_kg / 3 + end_mass) * linkage.rocker_length_m * linkage.rocker_length_m;
  const PlanarVector f = first * (bars.h.p - pin), f1 = first * bars.h.d1, f2 = first * bars.h.d2;
  lump.mass += mass;
  lump.first += mass * pin + f;
  lump.first1 += f1;
  lump.first2 += f2;
  lump.second += polar + mass * pin.squaredNorm() + 2 * pin.dot(f);
  lump.second1 += 2 * pin.dot(f1);
  lump.mixed += polar * bars.turn1 + cross(pin, f1);
  lump.mixed1 += polar * bars.turn2 + cross(pin, f2);
  lump.own += polar * bars.turn1 * bars.turn1;
  lump.own1 += 2 * polar * bars.turn1 * bars.turn2;
}

PoseGeometry RigidBody::pose(const JointVector& joint_rad) const noexcept {
  const double l0 = machine_.links[kBoom].length_m, l1 = machine_.links[kArm].length_m;
  // The bucket first: its chain of roots and divisions is the longest, the others are worked out in its shade.
  const BucketLinkage& linkage = machine_.bucket_linkage;
  const Turn q2(joint_rad[2]);
  const FourBar bars = four_bar(linkage, turning_pin({l1, 0}, q2, linkage.bucket_pin_m));
  const PinLine bucket = pin_line(linkage.cylinder_pin_m, bars.h);
  const Turn q0(joint_rad[0]);
  const MovingPoint boom_pin = turning_pin(PlanarVector::Zero(), q0, machine_.boom_mount.child_pin_m);
  const PinLine boom = pin_line(machine_.boom_mount.parent_pin_m, boom_pin);
  const Turn q1(joint_rad[1]);
  const MovingPoint arm_pin = turning_pin({l0, 0}, q1, machine_.arm_mount.child_pin_m);
  const PinLine arm = pin_line(machine_.arm_mount.parent_pin_m, arm_pin);

  PoseGeometry pose;
  pose.boom = q0;
  pose.arm = q0 * q1;
  pose.bucket = pose.arm * q2;
  pose.boom_m = l0 * PlanarVector(pose.boom.c, pose.boom.s);
  pose.arm_m = l1 * PlanarVector(pose.arm.c, pose.arm.s);
  pose.bucket_m = machine_.links[kBucket].length_m * PlanarVector(pose.bucket.c, pose.bucket.s);
  pose.linkage_m = pose.arm * bars.h.p;
  pose.linkage1_m = pose.arm * bars.h.d1;
  add_cylinder(pose.on_hull, rods_[kBoom], machine_.boom_mount.parent_pin_m, boom_pin, boom);
  pose.on_boom = links_[kBoom];
  add_cylinder(pose.on_boom, rods_[kArm], machine_.arm_mount.parent_pin_m, arm_pin, arm);
  pose.on_arm = links_[kArm];
  add_cylinder(pose.on_arm, rods_[kBucket], linkage.cylinder_pin_m, bars.h, bucket);
  add_rocker(pose.on_arm, bars);

  pose.length_m = {boom.length_m, arm.length_m, bucket.length_m};
  pose.lever_m = {boom.lever_m, arm.lever_m, bucket.lever_m};
  return pose;
}

void RigidBody::shift(PoseGeometry& pose, const JointVector& by) noexcept {
  const double w0 = by[0], w1 = w0 + by[1], w2 = w1 + by[2];
  const auto turn = [](Turn& axes, double w) { axes = {axes.c - w * axes.s, axes.s + w * axes.c}; };
  pose.length_m += pose.lever_m.cwiseProduct(by);
  pose.boom_m += w0 * perp(pose.boom_m);
  pose.arm_m += w1 * perp(pose.arm_m);
  pose.bucket_m += w2 * perp(pose.bucket_m);
  turn(pose.boom, w0);
  turn(pose.arm, w1);
  turn(pose.bucket, w2);
  pose.linkage_m += w1 * perp(pose.linkage_m) + by[2] * pose.linkage1_m;
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

ArmForces RigidBody::inverse_dynamics(const PoseGeometry& pose, const JointVector& rate,
                                      const JointVector& acceleration, const BucketLoad& load,
                                      const BaseMotion& base) const noexcept {
  const double w = base.rate_radps, w0 = w + rate[0], w1 = w0 + rate[1], w2 = w1 + rate[2];
  const double a = base.rate_radps2, a0 = a + acceleration[0], a1 = a0 + acceleration[1], a2 = a1 + acceleration[2];
  const PlanarVector &e = pose.boom_m, &d = pose.arm_m;
  const PlanarVector& shoulder = base.pin_mps2;
  const PlanarVector elbow = shoulder + a0 * perp(e) - w0 * w0 * e;
  const PlanarVector wrist = elbow + a1 * perp(d) - w1 * w1 * d;

  const Lump& link = links_[kBucket];
  const PlanarVector bucket_first = pose.bucket * (link.first + load.first_kgm);
  const PlanarVector bucket_force =
      (link.mass + load.mass_kg) * wrist + a2 * perp(bucket_first) - w2 * w2 * bucket_first;
  const double bucket_moment = cross(bucket_first, wrist) + a2 * (link.second + load.second_kgm2);

  const FullLumpForce arm = lump_force(pose.on_arm, pose.arm, elbow, {w1, a1, rate[2], acceleration[2]});
  const FullLumpForce boom = lump_force(pose.on_boom, pose.boom, shoulder, {w0, a0, rate[1], acceleration[1]});
  const FullLumpForce hull = lump_force(pose.on_hull, Turn(), shoulder, {w, a, rate[0], acceleration[0]});
  const double about_elbow = bucket_moment + cross(d, bucket_force) + arm.moment;
  const double about_pin = about_elbow + cross(e, bucket_force + arm.force) + boom.moment;
  return {{about_pin + hull.own, about_elbow + boom.own, bucket_moment + arm.own},
          bucket_force + arm.force + boom.force + hull.force,
          about_pin + hull.moment};
}

double RigidBody::potential_energy(const PoseGeometry& pose, const BucketLoad& load,
                                   const PlanarVector& lift_mps2) const noexcept {
  const Lump& bucket = links_[kBucket];
  const PlanarVector first = pose.on_hull.first + pose.boom * pose.on_boom.first + pose.on_arm.mass * pose.boom_m +
                             pose.arm * pose.on_arm.first + (bucket.mass + load.mass_kg) * (pose.boom_m + pose.arm_m) +
                             pose.bucket * (bucket.first + load.first_kgm);
  return lift_mps2.dot(first);
}

PlanarVector RigidBody::tip_rate(const PoseGeometry& pose, const JointVector& rate) noexcept {
  const double w0 = rate[0], w1 = w0 + rate[1], w2 = w1 + rate[2];
  return perp(w0 * pose.boom_m + w1 * pose.arm_m + w2 * pose.bucket_m);
}

PlanarVector RigidBody::bucket_pin_rate(const PoseGeometry& pose, const JointVector& rate) noexcept {
  return perp(rate[0] * pose.boom_m + (rate[0] + rate[1]) * pose.arm_m);
}

PlanarVector RigidBody::linkage_rate(const PoseGeometry& pose, const JointVector& rate) noexcept {
  return perp(rate[0] * pose.boom_m + (rate[0] + rate[1]) * pose.linkage_m) + rate[2] * pose.linkage1_m;
}

JointVector RigidBody::bucket_torque(const PoseGeometry& pose, const PlanarVector& force, double moment) noexcept {
  const double arm = moment + cross(pose.arm_m, force);
  return {arm + cross(pose.boom_m, force), arm, moment};
}

JointVector RigidBody::linkage_torque(const PoseGeometry& pose, const PlanarVector& force) noexcept {
  const double arm = cross(pose.linkage_m, force);
  return {arm + cross(pose.boom_m, force), arm, pose.linkage1_m.dot(force)};
}

}  // namespace knuckle::sim
