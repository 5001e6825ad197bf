// The machine's CAN bus as the machine file says: nodes, rates, time limits. Plain data in SI units, no behaviour.
#pragma once

#include <array>
#include <cstdint>

#include "core/joints.h"

namespace knuckle {

/// Identity a node must show (objects 0x1000 and 0x1018:01, :02) before anything moves, and what its process data are
/// sent under.
struct NodeDescription {
  std::uint8_t id = 0;
  std::uint32_t device_type = 0, vendor = 0, product = 0;
  std::uint16_t tpdo = 0, rpdo = 0;  ///< COB-ID of its first PDO from and to it; 0: pre-defined connection set.
  [[nodiscard]] constexpr std::uint32_t tpdo_id() const noexcept { return tpdo != 0 ? tpdo : 0x180U + id; }
  [[nodiscard]] constexpr std::uint32_t rpdo_id() const noexcept { return rpdo != 0 ? rpdo : 0x200U + id; }
};

/// How values are written on the wire where devices differ.
struct WireDescription {
  double valve_full_stroke = 16384;      ///< Set-point and actual value (CiA 408) at 100 % of spool stroke.
  bool pressure_float = false;           ///< 0x6130:01 (float32, bar) instead of 0x9130:01 (integer).
  int pressure_digits = 2;               ///< Of the integer, in bar (0x6132:01).
  double encoder_speed_step_mps = 1e-4;  ///< 0x6005:02
};

/// CANopen side of the machine.
struct BusDescription {
  std::uint32_t bit_rate = 500000;
  double sync_Hz = 200;  ///< The slave loop's rate.
  int set_point_every_nth_sync = 1, valve_status_every_nth_sync = 4, tilt_every_nth_sync = 2;
  double controller_heartbeat_s = 0.05;
  double node_heartbeat_s = 0.1;  ///< What nodes are told to produce.
  double node_heartbeat_timeout_s = 0.25;
  double valve_watchdog_s = 0.05;      ///< RPDO event timer of the valve nodes.
  double controller_timeout_s = 0.15;  ///< Consumer time of the nodes for the controller's heartbeat.
  double sensor_age_limit_s = 0.025;
  // Patience of the start-up.
  double sdo_timeout_s = 0.25;      ///< For an SDO answer; asked twice.
  double boot_timeout_s = 1;        ///< Boot-up message after a reset; some nodes calibrate first.
  double start_timeout_s = 1;       ///< "Operational" after NMT start.
  double activate_timeout_s = 0.5;  ///< Valves ACTIVE after the control words.
  std::uint8_t controller_id = 1;
  WireDescription wire;
  PerJoint<NodeDescription> valves{};
  std::array<NodeDescription, 6> pressures{};  ///< boom A, B, arm A, B, bucket A, B
  PerJoint<NodeDescription> encoders{};
  NodeDescription tilt, enable;
};

}  // namespace knuckle
