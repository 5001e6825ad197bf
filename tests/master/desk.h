// The haptic device, the machine's joint ranges and the limb that tests of the operator's side share.
#pragma once

#include "core/joints.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "sim/person.h"

namespace knuckle::test {

inline const JointVector kMidPosture{0.35, -1.5, -0.8};

/// The shipped desk device (config/devices/knuckle1.toml), written out again: a file's change must be noticed here.
inline DeviceDescription desk_device() {
  DeviceDescription device;
  device.name = "desk";
  device.link_m = JointVector(0.175, 0.095, 0.05);
  device.min_rad = {-0.474, -2.585, -2.5};
  device.max_rad = {1.092, -0.510, 0.784};
  device.counts_per_turn = {32768, 16384, 8192};
  device.gear_ratio = {15, 15, 10};
  device.torque_constant_Nm_per_A = {0.0259, 0.0259, 0.0234};
  device.rated_current_A = {3.4, 3.4, 1.2};
  device.peak_current_A = {7, 6, 2.5};
  device.rotor_inertia_kgm2 = {3.35e-6, 3.35e-6, 1.08e-6};
  device.link_inertia_kgm2 = {4e-3, 8e-4, 8e-5};
  device.friction_Nm = {0.015, 0.007, 0.0025};
  device.viscous_Nms = {5e-3, 2e-3, 5e-4};
  device.cogging_Nm = {0.003, 0.002, 0.0005};
  device.cogging_periods = {13, 13, 11};
  device.thermal_time_constant_s = {16, 16, 12};
  device.joint_sign = {1, -1, 1};
  device.zero_counts = {12000, -4000, 900};
  return device;
}

inline MachineDescription desk_machine() {
  MachineDescription machine;
  machine.name = "desk";
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
