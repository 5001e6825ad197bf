// What each node of the bus is called: its key under [bus.nodes] of a machine file, also in scenarios, options and
// reports.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/joints.h"
#include "machine/bus_description.h"

namespace knuckle {

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
