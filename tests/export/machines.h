// Machines as files say, with and without what an identification has found.
#pragma once

#include <string>

#include "machine/description.h"
#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::test {

inline std::string machine_file(const std::string& name) {
  return source_dir() + "/config/machines/" + name + ".toml";
}

/// Lengths and parameters of an arm like the shipped one's, but different in each number.
inline MachineDescription calibrated_machine() {
  MachineDescription machine = load_machine(machine_file("solar015"));
  GeometryCalibration geometry;
  geometry.length_m = {1.757, 0.943, 0.508};
  geometry.boom_parent_pin_m = machine.boom_mount.parent_pin_m;
  geometry.boom_child_pin_m = machine.boom_mount.child_pin_m;
  geometry.arm_parent_pin_m = machine.arm_mount.parent_pin_m;
  geometry.arm_child_pin_m = machine.arm_mount.child_pin_m;
  geometry.cylinder_pin_m = machine.bucket_linkage.cylinder_pin_m;
  geometry.rocker_pin_m = machine.bucket_linkage.rocker_pin_m;
  geometry.bucket_pin_m = machine.bucket_linkage.bucket_pin_m;
  geometry.rocker_length_m = machine.bucket_linkage.rocker_length_m;
  geometry.coupler_length_m = machine.bucket_linkage.coupler_length_m;
  geometry.encoder_offset_m = {0.0015, -0.002, 0.0005};
  machine.geometry_calibration = geometry;
  DynamicsCalibration dynamics;
  dynamics.parameters.head<kBaseCount>() << 611, 86, 12.4, 372, 97, 21.6, 28.1, 1.1, 15.2;
  machine.dynamics_calibration = dynamics;
  machine.name = "identified";
  machine.calibration_provenance = CalibrationProvenance{"full", "2026-11-21T05:00:00Z", "00", "a--b.csv", "test"};
  return machine;
}

}  // namespace knuckle::test
