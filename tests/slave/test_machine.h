// A machine of the 1.5 t class for the tests of this folder, written out so that expected limits can be stated again.
#pragma once

#include "machine/description.h"
#include "tests/support/bus_nodes.h"

namespace knuckle::test {

inline MachineDescription test_machine() {
  constexpr double kScale = 0.854;
  MachineDescription m;
  m.name = "test";
  m.source = "tests/slave/test_machine.h";
  const auto link = [](double length, double mass, PlanarVector com, double inertia, double min, double max) {
    return LinkDescription{length, mass, com, inertia, min, max, 0.8};
  };
  m.links = {link(1.75, 100, {0.967, 0.196}, 32, -0.474, 1.092), link(0.95, 60, {0.471, -0.022}, 6, -2.585, -0.510),
             link(0.50, 60, {0.368, 0.228}, 2, -2.5, 0.784)};
  m.boom_mount = {PlanarVector(0.135, -0.264) * kScale, PlanarVector(1.025, 0.278) * kScale};
  m.arm_mount = {PlanarVector(0.977, 0.737) * kScale, PlanarVector(-0.251, 0.158) * kScale};
  m.bucket_linkage = {PlanarVector(-0.134, 0.320) * kScale,
                      PlanarVector(0.880, 0) * kScale,
                      PlanarVector(-0.014, 0.164) * kScale,
                      0.240 * kScale,
                      0.240 * kScale,
                      1,
                      3,
                      3};
  const ValveDescription valve{30e-3 / 60, 15e5, 0.11, 0.11, 0.01, 0.015, 10, 0.8, 0.06};
  const auto cylinder = [&valve](double bore, double min, double max, double coulomb) {
    return CylinderDescription{bore, 0.035, min, max, 6, 4, {coulomb, 1.4, 0.01, 20e3}, valve};
  };
  m.cylinders = {cylinder(0.065, 0.74, 1.15, 350), cylinder(0.060, 0.86, 1.36, 300), cylinder(0.060, 0.75, 1.11, 250)};
  m.hydraulics = {32e-3 / 60, 8000, 17e5, 0.07, 205e5, 230e5, 2e5, 0.9e9, 0.15e-3, 5e5 / 1e-3};
  m.sensors = {400e5, 0.1e5, 0.3e5, 1e-4, 0.1 * 0.017453292519943295, 0.0005, SensorDescription::TiltMount::kOnHull};
  m.bus.nodes = one_node_each();
  constexpr std::array<std::uint32_t, 5> kVendor{0x1001, 0x1002, 0x1003, 0x1004, 0x1005},
      kProduct{0x10, 0x20, 0x30, 0x38, 0x40};
  for (NodeDescription& node : m.bus.nodes) {
    node.vendor = kVendor[static_cast<std::size_t>(node.role)];
    node.product = kProduct[static_cast<std::size_t>(node.role)];
  }
  m.limits.tip_speed_mps = 1.2;
  m.limits.joint_soft_margin_rad = 0.08;
  m.limits.chamber_pressure_Pa = 240e5;
  m.limits.tip_force_N = 10e3;
  m.limits.power_W = 8000;
  m.payload_full_scale_kg = 150;
  m.payload_com_m = {0.3, 0.15};
  return m;
}

/// The same, its valves measured and found as drawn.
inline MachineDescription identified_machine() {
  MachineDescription m = test_machine();
  for (std::size_t i = 0; i < kJoints; ++i) {
    const ValveDescription& valve = m.cylinders[i].valve;
    m.valve_calibration[i] =
        ValveCalibration{valve.dead_band_extend, valve.dead_band_retract, valve.delay_s, valve.nominal_flow_m3ps};
  }
  return m;
}

}  // namespace knuckle::test
