// Nodes of a machine's bus, for tests that make or change them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "machine/bus_description.h"

namespace knuckle::test {

/// A node for each signal: valves from 0x10, pressures from 0x20, encoders from 0x30, tilt 0x38, enable 0x40.
inline std::vector<NodeDescription> one_node_each() {
  std::vector<NodeDescription> nodes;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    const SignalInfo& signal = kSignals[i];
    if (signal.is_angle || is_optional(signal)) continue;
    NodeDescription node;
    node.name = signal.name;
    for (const auto& [from, to] :
         {std::pair("_spool", "_valve"), {"_length", "_encoder"}, {"slope", "tilt"}, {"machine_enable", "enable"}}) {
      const auto at = node.name.find(from);
      if (at != std::string::npos) node.name.replace(at, std::string::npos, to);
    }
    constexpr std::array kFirstId{0x10, 0x20, 0x30, 0x38, 0x40};
    constexpr std::array kProfile{408U, 404U, 406U, 410U, 401U};
    node.role = signal.role;
    node.channels = {{1, static_cast<std::uint8_t>(i)}};
    node.id = static_cast<std::uint8_t>(kFirstId[static_cast<std::size_t>(signal.role)] + signal.index);
    node.device_type = kProfile[static_cast<std::size_t>(signal.role)];
    nodes.push_back(node);
  }
  return nodes;
}

inline NodeDescription& node_in(BusDescription& bus, NodeRole role, int index = 0) {
  const NodeDescription& found = bus.node_of(role, index);
  return bus.nodes.at(static_cast<std::size_t>(&found - bus.nodes.data()));
}

/// The valves become one node, that of the boom's, with these axes for boom, arm and bucket.
inline void join_valves(BusDescription& bus, const std::array<std::uint8_t, 3>& axes = {1, 2, 3}) {
  NodeDescription& joined = node_in(bus, NodeRole::kValve);
  joined.name = "valves";
  joined.channels.clear();
  for (std::uint8_t number = 1; number <= NodeDescription::kMostPdos; ++number)
    for (std::uint8_t joint = 0; joint < axes.size(); ++joint)
      if (axes[joint] == number) joined.channels.push_back({number, joint});
  std::erase_if(bus.nodes,
                [](const NodeDescription& node) { return node.role == NodeRole::kValve && node.name != "valves"; });
}

inline std::vector<NodeDescription> nodes_with(const BusDescription& bus, NodeRole role) {
  std::vector<NodeDescription> nodes;
  for (const NodeDescription& node : bus.nodes) {
    if (node.role == role) nodes.push_back(node);
  }
  return nodes;
}

}  // namespace knuckle::test
