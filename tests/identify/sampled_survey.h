// Surveys of sampled machines, by the simulator's own linkage geometry: calibration is never tested against itself.
#pragma once

#include <random>
#include <vector>

#include "estimation/identification/kinematic_calibration.h"
#include "sim/linkage.h"
#include "sim/truth.h"

namespace knuckle::identify {

/// True lengths and levers of the three cylinders.
struct TrueCylinders {
  JointVector length_m, lever_m;
};

inline TrueCylinders true_cylinders(const MachineDescription& machine, const JointVector& joints_rad) {
  const auto triangle = [&](const TriangleMount& mount, const PlanarVector& joint, double angle) {
    return sim::pin_line(mount.parent_pin_m, sim::turning_pin(joint, sim::Turn(angle), mount.child_pin_m));
  };
  const PlanarVector bucket_joint(machine.links[kArm].length_m, 0);
  const BucketLinkage& linkage = machine.bucket_linkage;
  const sim::PinLine lines[] = {
      triangle(machine.boom_mount, PlanarVector::Zero(), joints_rad[kBoom]),
      triangle(machine.arm_mount, PlanarVector(machine.links[kBoom].length_m, 0), joints_rad[kArm]),
      sim::pin_line(
          linkage.cylinder_pin_m,
          sim::four_bar(linkage, sim::turning_pin(bucket_joint, sim::Turn(joints_rad[kBucket]), linkage.bucket_pin_m))
              .h)};
  TrueCylinders cylinders;
  for (int i = 0; i < kJoints; ++i) {
    cylinders.length_m[i] = lines[i].length_m;
    cylinders.lever_m[i] = lines[i].lever_m;
  }
  return cylinders;
}

/// Arm pin, bucket pin, tip.
inline std::array<PlanarVector, kJoints> true_points(const MachineDescription& machine, const JointVector& joints_rad) {
  std::array<PlanarVector, kJoints> points;
  PlanarVector at = PlanarVector::Zero();
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    at += sim::Turn(joints_rad.head(i + 1).sum()) * PlanarVector(machine.links[k].length_m, 0);
    points[k] = at;
  }
  return points;
}

inline JointVector true_reading(const sim::MachineTruth& truth, const JointVector& joints_rad) {
  const double step = truth.machine.sensors.encoder_step_m;
  const JointVector reading = true_cylinders(truth.machine, joints_rad).length_m + truth.encoder_offset_m;
  return step > 0 ? JointVector((reading / step).array().round() * step) : reading;
}

/// Where the machine really stands when its readings are those of `pose` on the drawing: so a controller poses it.
inline JointVector true_pose(const sim::MachineTruth& truth, const MachineDescription& nominal,
                             const JointVector& pose) {
  const JointVector length = true_cylinders(nominal, pose).length_m - truth.encoder_offset_m;
  JointVector joints = pose;
  for (int i = 0; i < 20; ++i) {  // Newton; a cylinder's length depends on its own joint alone
    const TrueCylinders cylinders = true_cylinders(truth.machine, joints);
    joints += (length - cylinders.length_m).cwiseQuotient(cylinders.lever_m);
  }
  return joints;
}

/// @param poses on the drawing.
inline estimation::Survey sampled_survey(const sim::MachineTruth& truth, const MachineDescription& nominal,
                                         const std::vector<JointVector>& poses, double sigma_m, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> error(0, sigma_m);
  const auto measured = [&](const PlanarVector& p) {
    const double dx = error(random);
    return PlanarVector(p + PlanarVector(dx, error(random)));
  };
  estimation::Survey survey;
  survey.source = "drawn machine";
  survey.point_sigma_m = sigma_m;
  for (const JointVector& asked : poses) {
    const JointVector pose = true_pose(truth, nominal, asked);
    const auto points = true_points(truth.machine, pose);
    const PlanarVector arm_pin = measured(points[0]), bucket_pin = measured(points[1]);
    survey.poses.push_back({true_reading(truth, pose), arm_pin, bucket_pin, measured(points[2])});
  }
  return survey;
}

}  // namespace knuckle::identify
