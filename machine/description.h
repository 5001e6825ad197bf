// What a machine *is*, as its file says: plain data in SI units, no behaviour. Frames: see arm_description.h. The
// simulator reads these descriptions and the haptic device's, and nothing else of this folder.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/joints.h"
#include "machine/arm_description.h"
#include "machine/bus_description.h"
#include "machine/calibration.h"
#include "machine/contact_model.h"

namespace knuckle {

// A camera that is mounted on the machine, as `[[camera]]` of its file says: where its lens is and what it looks at.

/// Fixed to the machine's base, without lens distortion, its horizon level.
struct CameraDescription {
  std::string name;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Of the lens, frame M with y to the left.
  double pan_rad = 0;                                    ///< Positive: to the left of straight ahead.
  double tilt_rad = 0;                                   ///< Positive: above the horizon.
  double field_of_view_rad = 1;                          ///< Across the width of its picture.
};

struct LimitsDescription {
  double tip_speed_mps = 0;               ///< Commanded tip speed limit.
  double joint_soft_margin_rad = 0;       ///< Where soft walls begin, inside the working range.
  double chamber_pressure_Pa = 0;         ///< Gate: beyond it no command that raises it.
  double tip_force_N = 0;                 ///< Ceiling on what the tip may press, by estimate.
  double power_W = 0;                     ///< Gate: hydraulic power.
  double floor_m = -1e9;                  ///< Virtual wall: tip z in M stays above.
  double ceiling_m = 1e9, reach_m = 1e9;  ///< Likewise tip z below, tip x below.
};

struct MachineDescription {
  std::string name;
  std::string source;  ///< File it was read from.
  std::string text;    ///< Of that file.
  PerJoint<LinkDescription> links{};
  TriangleMount boom_mount, arm_mount;
  BucketLinkage bucket_linkage;
  BucketProfile bucket_profile;
  PerJoint<CylinderDescription> cylinders{};
  HydraulicsDescription hydraulics;
  SensorDescription sensors;
  BusDescription bus;
  LimitsDescription limits;
  ForceDescription force;
  double payload_full_scale_kg = 0;
  PlanarVector payload_com_m = PlanarVector::Zero();  ///< Where a full bucket's load sits, bucket axes.
  std::vector<CameraDescription> cameras;             ///< On the machine, of which the pose is known; often none.
  // What identification has found out; nothing of it is in the values above until calibrated() has put it there.
  std::optional<DynamicsCalibration> dynamics_calibration;
  std::optional<GeometryCalibration> geometry_calibration;
  std::optional<GeometryCalibration> drawing;                   ///< What calibrated() has replaced by that.
  PerJoint<std::optional<ValveCalibration>> valve_calibration;  ///< Of the axes whose valve was identified.
  std::optional<CalibrationProvenance> calibration_provenance;
  /// Force scale etc. of the bilateral law live with the device; the slave's contact law in ControlDescription.
  struct Control {
    double position_gain_1ps = 3;                                 ///< Kp
    double tip_stiffness_N_per_m = 1e5;                           ///< Ks
    JointVector stiffness_radius_m = JointVector(2.4, 1.3, 1.0);  ///< L_i: weights 1/L_i^2 of what yields.
    double contact_crossover_radps = 12;                          ///< Of "rate, oil, force, compliance", at most.
    double feed_forward_fade_N = 500;                             ///< F1
    double bucket_position_gain_1ps = 3;                          ///< Kp of the bucket joint
    double dither = 0.0075;                                       ///< Fraction of spool stroke; 0 = off.
    double learning_limit = 0.015;                                ///< Of the dead band, fraction of spool stroke.
    double dead_band_fill = 0.95;                                 ///< Compensated fraction of the dead band.
  } control;
};

/// Reach of the stretched arm: the machine's size.
[[nodiscard]] inline double reach_m(const MachineDescription& machine) noexcept {
  return machine.links[kBoom].length_m + machine.links[kArm].length_m + machine.links[kBucket].length_m;
}
/// Height of the ground that the tracks stand on, frame M; the description does not say, so it is what machines with
/// this reach usually have.
[[nodiscard]] inline double ground_level_m(const MachineDescription& machine) noexcept {
  return -0.25 * reach_m(machine);
}

/// The machine as controller and estimator are to see it: geometry, encoder offsets and valves replaced by what was
/// calibrated. The simulator's machine is sampled around the description as it was read.
[[nodiscard]] MachineDescription calibrated(const MachineDescription& machine);
/// With the geometry of its file's drawing again, where calibrated() has replaced that.
[[nodiscard]] MachineDescription as_drawn(const MachineDescription& machine);

}  // namespace knuckle
