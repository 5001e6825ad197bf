// The haptic device, the machine's joint ranges and the limb that tests of the operator's side share.
#pragma once

#include "core/joints.h"
#include "machine/description.h"
#include "sim/operator_limb.h"

namespace knuckle::test {

inline const JointVector kMidPosture{0.35, -1.5, -0.8};

/// A desk device at 1:10 of a 1.5 t machine: 3 um a count at the tip, 8 N for a while, 4 N for ever.
inline DeviceDescription desk_device() {
  DeviceDescription device;
  device.name = "desk";
  device.link_m = JointVector(0.175, 0.095, 0.05);
  device.min_rad = {-0.6, -2.7, -2.6};
  device.max_rad = {1.2, -0.4, 0.9};
  device.counts_per_turn = {65536, 65536, 65536};
  device.gear_ratio = {12, 10, 8};
  device.torque_constant_Nm_per_A = {0.06, 0.04, 0.02};
  device.rated_current_A = {2, 1.5, 1.2};
  device.peak_current_A = {5, 4, 3.5};
  device.rotor_inertia_kgm2 = {1.2e-5, 6e-6, 1.5e-6};
  device.link_inertia_kgm2 = {1.5e-3, 3e-4, 4e-5};
  device.friction_Nm = {0.008, 0.004, 0.0015};
  device.viscous_Nms = {2e-3, 1e-3, 2e-4};
  device.cogging_Nm = {0.003, 0.0015, 0.0006};
  device.cogging_periods = {12, 12, 12};
  device.thermal_time_constant_s = {30, 25, 20};
  device.joint_sign = {1, -1, 1};
  device.zero_counts = {1000, -2000, 0};
  return device;
}

inline MachineDescription desk_machine() {
  MachineDescription machine;
  const JointVector length(1.75, 0.95, 0.5), low(-0.474, -2.585, -2.5), high(1.092, -0.510, 0.784);
  for (std::size_t i = 0; i < kJoints; ++i) {
    machine.links[i].length_m = length[Eigen::Index(i)];
    machine.links[i].min_rad = low[Eigen::Index(i)];
    machine.links[i].max_rad = high[Eigen::Index(i)];
  }
  machine.limits.joint_soft_margin_rad = 0.05;
  return machine;
}

inline sim::LimbImpedance steady_limb() {
  return {1.0, 20, 400, 3e-3, 0.05, 4};
}

}  // namespace knuckle::test
