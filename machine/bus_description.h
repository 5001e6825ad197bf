// The machine's CAN bus as the machine file says: nodes, rates, time limits. Plain data in SI units, no behaviour.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/joints.h"

namespace knuckle {

/// How a device of CiA 408 is led through its states.
enum class ValveProfile : std::uint8_t {
  kCia408,
  kPved,  ///< Danfoss PVED-CC: bit 3 of the control word on in every state, off and on to leave a fault; slow to boot.
};
/// As machine files call them, in the order of ValveProfile.
inline constexpr std::array kValveProfileNames{"cia408", "cia408/pved"};

/// Identity a node must show (objects 0x1000 and 0x1018:01, :02) before anything moves, and what its process data are
/// sent under.
struct NodeDescription {
  std::uint8_t id = 0;
  std::uint32_t device_type = 0, vendor = 0, product = 0;
  ValveProfile profile = ValveProfile::kCia408;  ///< Of a valve.
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

// What each node of the bus is called: its key under [bus.nodes] of a machine file, also in scenarios, options and
// reports.

enum class NodeRole : std::uint8_t { kValve, kPressure, kEncoder, kTilt, kEnable };

/// Calls visit(role, joint, name, node) for every node of a BusDescription, in the order valves, pressures, encoders,
/// tilt, enable. joint: -1 for tilt and enable.
template <typename Bus, typename Visit>
void visit_nodes(Bus& bus, const Visit& visit) {
  const auto of_joint = [&visit](NodeRole role, std::size_t joint, const char* what, auto& node) {
    visit(role, static_cast<int>(joint), std::string(kJointNames[joint]) + what, node);
  };
  for (std::size_t j = 0; j < kJoints; ++j) of_joint(NodeRole::kValve, j, "_valve", bus.valves[j]);
  for (std::size_t j = 0; j < kJoints; ++j) {
    of_joint(NodeRole::kPressure, j, "_head_pressure", bus.pressures[2 * j]);
    of_joint(NodeRole::kPressure, j, "_rod_pressure", bus.pressures[2 * j + 1]);
  }
  for (std::size_t j = 0; j < kJoints; ++j) of_joint(NodeRole::kEncoder, j, "_encoder", bus.encoders[j]);
  visit(NodeRole::kTilt, -1, std::string("tilt"), bus.tilt);
  visit(NodeRole::kEnable, -1, std::string("enable"), bus.enable);
}

struct NamedNode {
  NodeRole role = NodeRole::kValve;
  int joint = -1;    ///< -1: of the whole machine.
  std::string name;  ///< "boom_valve", "arm_rod_pressure", "bucket_encoder", "tilt", "enable"
  NodeDescription node;
};
/// In the order of visit_nodes.
[[nodiscard]] std::vector<NamedNode> named_nodes(const BusDescription& bus);
/// The node of this name; null where there is none.
[[nodiscard]] const NamedNode* find_node(const std::vector<NamedNode>& nodes, const std::string& name);
/// "boom_valve, arm_valve, ...": for the line that refuses another name.
[[nodiscard]] std::string names_of(const std::vector<NamedNode>& nodes);

}  // namespace knuckle
