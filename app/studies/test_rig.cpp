#include "app/studies/test_rig.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "machine/planar_jacobian.h"
#include "sim/hull.h"

namespace knuckle::studies {
namespace {

constexpr double kHold_s = 2.0, kRamp_s = 0.5, kJudge_s = 0.5, kAround_s = 1.0;
constexpr double kPull_s = 2 * kRamp_s + kHold_s;
constexpr double kWeakest_N = 1000, kStrongest_N = 5000;
constexpr double kCreep_mps = 0.015;     // of the fastest cylinder
constexpr double kStrongest_Pa = 160e5;  // a pull that needs more would open the relief valves
constexpr double kLeastPush = 0.1;       // of the machine's weight that either end of the tracks must bear

/// Writes force into the samples from `at` on: ramp, hold, ramp.
void add_pull(std::vector<PlanarVector>& pull_N, std::size_t at, double step_s, const PlanarVector& force_N) {
  const auto n = static_cast<std::size_t>(std::lround(kPull_s / step_s));
  for (std::size_t i = 0; i < n && at + i < pull_N.size(); ++i) {
    const double t = static_cast<double>(i) * step_s;
    const double share = std::clamp(std::min(t, kPull_s - t) / kRamp_s, 0.0, 1.0);
    pull_N[at + i] = share * force_N;
  }
}

PlanarVector along(double size, double angle_rad) {
  return size * PlanarVector(std::cos(angle_rad), std::sin(angle_rad));
}

}  // namespace

Rig::Rig(const MachineDescription& machine, const sim::HullTruth& hull, double step_s, std::uint64_t seed)
    : machine_(machine),
      hull_(hull),
      kinematics_(machine),
      weight_(estimation::lumped_parameters(machine)),
      step_s_(step_s),
      sampler_(seed) {}

JointVector Rig::pose() {
  JointVector q;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine_.links[static_cast<std::size_t>(i)];
    const double room = 0.15 * (link.max_rad - link.min_rad);
    q[i] = sampler_.within(link.min_rad + room, link.max_rad - room);
  }
  return q;
}

double Rig::duration_s(const JointVector& from, const JointVector& to, double cylinder_mps) const {
  double furthest = 0;
  for (int i = 0; i < kJoints; ++i) {
    furthest = std::max(furthest, std::abs(kinematics_.cylinder_at(i, to[i])->length_m -
                                           kinematics_.cylinder_at(i, from[i])->length_m));
  }
  return std::max(0.5, motion::PathBuilder::kPeak * furthest / cylinder_mps);
}

JointVector Rig::crept(const JointVector& from, const JointVector& towards) const {
  return from + std::min(1.0, kPull_s / duration_s(from, towards, kCreep_mps)) * (towards - from);
}

PlanarVector Rig::pull(const JointVector& pose_rad) {
  for (;;) {
    const double size = sampler_.within(kWeakest_N, kStrongest_N), angle = sampler_.within(0, 2 * std::numbers::pi);
    if (holds(pose_rad, along(size, angle), PlanarVector::Zero())) return along(size, angle);
  }
}

std::optional<PlanarVector> Rig::pull(const JointVector& pose_rad, double angle_rad, const PlanarVector& from_tip_m) {
  constexpr int kTries = 20;
  for (int i = 0; i < kTries; ++i) {
    const PlanarVector force = along(sampler_.within(kWeakest_N, kStrongest_N), angle_rad);
    if (holds(pose_rad, force, from_tip_m)) return force;
  }
  return std::nullopt;
}

bool Rig::holds(const JointVector& q, const PlanarVector& force, const PlanarVector& from_tip_m) const {
  const PlanarJacobian jacobian = beside_tip(kinematics_.tip_jacobian(q), Eigen::Rotation2Dd(q.sum()) * from_tip_m);
  const estimation::Pose at(q, 0);
  const JointVector torque =
      estimation::joint_torque(estimation::RigidArm::gravity(at) * weight_) - jacobian.transpose() * force;
  for (int i = 0; i < kJoints; ++i) {
    const CylinderDescription& cylinder = machine_.cylinders[static_cast<std::size_t>(i)];
    const double needed_N = torque[i] / kinematics_.cylinder_at(i, q[i])->lever_m;
    if (needed_N > kStrongest_Pa * cylinder.head_area_m2() || -needed_N > kStrongest_Pa * cylinder.rod_side_area_m2())
      return false;
  }
  return hull_.stiffness_N_per_m == 0 || stands(torque[kBoom], force);
}

/// @param boom_Nm what the boom's joint holds. Moments about the tracks' middle, positive where they lift the front.
bool Rig::stands(double boom_Nm, const PlanarVector& force) const {
  double arm_kg = 0;
  for (const LinkDescription& link : machine_.links) arm_kg += link.mass_kg;
  for (const CylinderDescription& c : machine_.cylinders) arm_kg += c.body_mass_kg + c.rod_mass_kg;
  const PlanarVector pin_m = -hull_.centre_m;
  const PlanarVector on_pin_N = force - PlanarVector(0, arm_kg * estimation::kGravity_mps2);
  const double lift_Nm = cross(pin_m, on_pin_N) - boom_Nm - hull_.com_m.x() * hull_.mass_kg * estimation::kGravity_mps2;
  const double weight_N = (hull_.mass_kg + arm_kg) * estimation::kGravity_mps2;
  const auto [rear_N, front_N] = sim::pushes_at_rest_N(hull_, weight_N - force.y(), -lift_Nm);
  return std::min(rear_N, front_N) > kLeastPush * weight_N;
}

void PullPath::go_to(const JointVector& pose_rad, double duration_s) {
  builder_.move(pose_rad, duration_s);
}

void PullPath::pull(const PlanarVector& force_N, const std::optional<JointVector>& creep_to_rad) {
  const double step_s = path().step_s;
  builder_.hold(kAround_s);
  const std::size_t start = builder_.size();
  if (creep_to_rad) {
    builder_.move(*creep_to_rad, kPull_s);
  } else {
    builder_.hold(kPull_s);
  }
  builder_.hold(kAround_s);
  const std::size_t end = start + static_cast<std::size_t>((kRamp_s + kHold_s) / step_s);
  starts_.push_back(start);
  presses_.push_back({force_N, creep_to_rad.has_value(), end - static_cast<std::size_t>(kJudge_s / step_s), end});
}

std::vector<PlanarVector> PullPath::pull_N() const {
  std::vector<PlanarVector> pull_N(builder_.size(), PlanarVector::Zero());
  for (std::size_t k = 0; k < starts_.size(); ++k) add_pull(pull_N, starts_[k], path().step_s, presses_[k].force_N);
  return pull_N;
}

}  // namespace knuckle::studies
