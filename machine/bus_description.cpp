#include "machine/bus_description.h"

#include <algorithm>
#include <utility>

namespace knuckle {

std::vector<NamedNode> named_nodes(const BusDescription& bus) {
  std::vector<NamedNode> nodes;
  visit_nodes(bus, [&nodes](NodeRole role, int joint, std::string name, const NodeDescription& node) {
    nodes.push_back({role, joint, std::move(name), node});
  });
  return nodes;
}

const NamedNode* find_node(const std::vector<NamedNode>& nodes, const std::string& name) {
  const auto found = std::find_if(nodes.begin(), nodes.end(), [&](const NamedNode& n) { return n.name == name; });
  return found == nodes.end() ? nullptr : &*found;
}

std::string names_of(const std::vector<NamedNode>& nodes) {
  std::string all;
  for (const NamedNode& node : nodes) all += (all.empty() ? "" : ", ") + node.name;
  return all;
}

}  // namespace knuckle
