// Shipped machine files with their nodes in other words.
#pragma once

#include <fmt/format.h>

#include <string>

#include "machine/load.h"

namespace knuckle::test {

/// The text of a shipped file with `nodes` in place of its [[bus.node]] tables.
inline std::string with_nodes(std::string text, const std::string& nodes) {
  const std::size_t begin = text.find('\n', text.find("\ncontroller_id = ") + 1) + 1, end = text.find("\n[limits]");
  return text.replace(begin, end - begin, nodes);
}

/// As older files have it: [bus.nodes], with a key for each node.
inline std::string with_keyed_nodes(const std::string& text) {
  std::string nodes = "[bus.nodes]\n";
  for (const NodeDescription& node : parse_machine(text, "shipped").bus.nodes) {
    nodes +=
        fmt::format("{:<20} = {{ id = 0x{:02X}, device_type = 0x{:04X}, vendor = 0x{:04X}, product = 0x{:04X} }}\n",
                    node.channels.at(0).info().node, node.id, node.device_type, node.vendor, node.product);
  }
  return with_nodes(text, nodes);
}

}  // namespace knuckle::test
