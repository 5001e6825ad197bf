// Machines as files say, with and without what an identification has found.
#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "machine/description.h"
#include "machine/load.h"
#include "tests/support/axes_machine.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/few_nodes.h"
#include "tests/support/rotary_machine.h"
#include "tests/support/shipped.h"

namespace knuckle::test {

/// Lengths and parameters of an arm like the shipped one's, but different in each number.
inline MachineDescription calibrated_machine() {
  MachineDescription machine = shipped("solar015");
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

/// Every choice that a machine file has about its wire, other than the shipped one's.
inline MachineDescription other_wire() {
  MachineDescription machine = shipped("compact080");
  machine.name = "other_wire";
  machine.bus.wire = {
      .valve_full_stroke = 10000, .pressure = WireDescription::Pressure::kFloat, .encoder_speed_step_mps = 1e-3};
  test::node_in(machine.bus, NodeRole::kValve, kArm).rpdos[0] = 0x305;
  test::node_in(machine.bus, NodeRole::kEncoder, kBoom).tpdos[0] = 0x2A5;
  machine.bus.controller_id = 5;
  machine.sensors.encoder_step_m = 2.5e-5;
  machine.sensors.tilt_step_rad = 0.01 * std::numbers::pi / 180;
  return machine;
}

inline MachineDescription coarse_pressures() {
  MachineDescription machine = shipped("solar015");
  machine.name = "coarse_pressures";
  machine.bus.wire.pressure_digits = 0;
  return machine;
}

/// All pressures on one node, two in a frame, as 16-bit integers.
inline MachineDescription one_transmitter() {
  MachineDescription machine = parse_machine(few_nodes_text(), "one_transmitter.toml");
  machine.name = "one_transmitter";
  return machine;
}

/// The shipped ones, an identified one, those three, one with rotary encoders, and one with a node for all valves.
inline std::vector<MachineDescription> machines_of_every_wire() {
  return {shipped("solar015"),
          shipped("compact080"),
          other_wire(),
          coarse_pressures(),
          one_transmitter(),
          calibrated_machine(),
          parse_machine(rotary_text(), "rotary"),
          parse_machine(axes_text(), "axes")};
}

}  // namespace knuckle::test
