// Puts calibrated geometry and valves into a machine description.
#include "machine/description.h"

namespace knuckle {

MachineDescription calibrated(const MachineDescription& machine) {
  MachineDescription result = machine;
  if (machine.geometry_calibration) {
    const GeometryCalibration& geometry = *machine.geometry_calibration;
    for (std::size_t i = 0; i < kJoints; ++i) {
      result.links[i].length_m = geometry.length_m[static_cast<Eigen::Index>(i)];
    }
    result.boom_mount = {geometry.boom_parent_pin_m, geometry.boom_child_pin_m};
    result.arm_mount = {geometry.arm_parent_pin_m, geometry.arm_child_pin_m};
    result.bucket_linkage.cylinder_pin_m = geometry.cylinder_pin_m;
    result.bucket_linkage.rocker_pin_m = geometry.rocker_pin_m;
    result.bucket_linkage.bucket_pin_m = geometry.bucket_pin_m;
    result.bucket_linkage.rocker_length_m = geometry.rocker_length_m;
    result.bucket_linkage.coupler_length_m = geometry.coupler_length_m;
    result.sensors.encoder_offset_m = geometry.encoder_offset_m;
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

}  // namespace knuckle
