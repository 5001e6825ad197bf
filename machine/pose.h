// Where the parts of the arm are at given joint angles: what every picture of the machine is drawn from.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "core/joints.h"
#include "machine/arm_description.h"
#include "machine/description_fwd.h"

namespace knuckle {

using Frame2 = Eigen::Isometry2d;  ///< (x forward, z up) in the arm's plane.

/// All in frame M. Letters as in the machine file: boom cylinder to D, arm cylinder E-F, bucket cylinder G-H, rocker
/// J-H, coupler H-K.
struct MachinePose {
  struct Cylinder {
    PlanarVector base_m, rod_end_m;
    [[nodiscard]] double length_m() const { return (rod_end_m - base_m).norm(); }
  };
  Frame2 boom, arm, bucket;  ///< Link axes.
  PerJoint<Cylinder> cylinders;
  PlanarVector rocker_pin_m;   ///< J
  PlanarVector linkage_pin_m;  ///< H
  PlanarVector bucket_pin_m;   ///< K
  PlanarVector tip_m;
};

/// Any angles: where the bucket linkage cannot reach, H lies on the line from J to K.
[[nodiscard]] MachinePose pose_of(const MachineDescription& machine, const JointVector& joints_rad);

/// From the base pin to where the rod comes out, at this pin-to-pin length; the description does not say, so it is
/// what cylinders usually leave for the rod's eye.
[[nodiscard]] double barrel_length_m(const CylinderDescription& cylinder, double length_m);

/// Corners of the bucket's outline in bucket axes, counter-clockwise from the tip.
[[nodiscard]] std::array<PlanarVector, 6> bucket_outline(const MachineDescription& machine);

/// The middle of each joint's range.
[[nodiscard]] JointVector middle_of_range(const MachineDescription& machine) noexcept;

}  // namespace knuckle
