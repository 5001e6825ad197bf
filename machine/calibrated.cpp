// Puts calibrated geometry and valves into a machine description.
#include "machine/description.h"

namespace knuckle {
namespace {

GeometryCalibration geometry_of(const MachineDescription& machine) {
  const BucketLinkage& linkage = machine.bucket_linkage;
  return {.length_m = {machine.links[kBoom].length_m, machine.links[kArm].length_m, machine.links[kBucket].length_m},
          .boom_parent_pin_m = machine.boom_mount.parent_pin_m,
          .boom_child_pin_m = machine.boom_mount.child_pin_m,
          .arm_parent_pin_m = machine.arm_mount.parent_pin_m,
          .arm_child_pin_m = machine.arm_mount.child_pin_m,
          .cylinder_pin_m = linkage.cylinder_pin_m,
          .rocker_pin_m = linkage.rocker_pin_m,
          .bucket_pin_m = linkage.bucket_pin_m,
          .rocker_length_m = linkage.rocker_length_m,
          .coupler_length_m = linkage.coupler_length_m,
          .encoder_offset_m = machine.sensors.encoder_offset_m};
}

void set_geometry(MachineDescription& machine, const GeometryCalibration& geometry) {
  for (std::size_t i = 0; i < kJoints; ++i) machine.links[i].length_m = geometry.length_m[static_cast<Eigen::Index>(i)];
  machine.boom_mount = {geometry.boom_parent_pin_m, geometry.boom_child_pin_m};
  machine.arm_mount = {geometry.arm_parent_pin_m, geometry.arm_child_pin_m};
  machine.bucket_linkage.cylinder_pin_m = geometry.cylinder_pin_m;
  machine.bucket_linkage.rocker_pin_m = geometry.rocker_pin_m;
  machine.bucket_linkage.bucket_pin_m = geometry.bucket_pin_m;
  machine.bucket_linkage.rocker_length_m = geometry.rocker_length_m;
  machine.bucket_linkage.coupler_length_m = geometry.coupler_length_m;
  machine.sensors.encoder_offset_m = geometry.encoder_offset_m;
}

}  // namespace

MachineDescription calibrated(const MachineDescription& machine) {
  MachineDescription result = machine;
  if (machine.geometry_calibration) {
    if (!result.drawing) result.drawing = geometry_of(machine);
    set_geometry(result, *machine.geometry_calibration);
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    const std::optional<ValveCalibration>& found = machine.valve_calibration[i];
    if (!found) continue;
    ValveDescription& valve = result.cylinders[i].valve;
    valve.dead_band_extend = found->dead_band_extend;
    valve.dead_band_retract = found->dead_band_retract;
    valve.delay_s = found->delay_s;
    valve.nominal_flow_m3ps = found->nominal_flow_m3ps;
    valve.curve_exponent = found->curve_exponent;
    valve.retract_share = found->retract_share;
    valve.notch_opening = found->notch_opening;
    valve.notch_slope = found->notch_slope;
  }
  return result;
}

MachineDescription as_drawn(const MachineDescription& machine) {
  MachineDescription result = machine;
  if (machine.drawing) set_geometry(result, *machine.drawing);
  result.geometry_calibration = {};
  return result;
}

}  // namespace knuckle
