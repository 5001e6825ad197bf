#include "app/explain/bus_cause.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/explain/text.h"
#include "core/frame_words.h"
#include "machine/bus_nodes.h"
#include "slave/bus_map.h"
#include "transport/canopen.h"

namespace knuckle::explain {
namespace {

struct Heard {
  Time first{};
  int times = 0;
};
using HeardById = std::map<std::uint32_t, Heard>;

/// What arrived under these identifiers near the stop.
HeardById heard(const Window& window, const Stop& stop, const auto& wanted) {
  HeardById found;
  for (const CanSeen& can : window.can) {
    const bool near = can.at >= stop.at - Evidence::kBefore && can.at <= stop.at + Evidence::kAfter;
    if (can.kind != WireEventKind::kCanReceived || !near || !wanted(can.frame.id)) continue;
    Heard& one = found.try_emplace(can.frame.id, Heard{can.at}).first->second;
    ++one.times;
  }
  return found;
}

/// Cause by foreign frames; the first of them is the first sign.
Cause by_foreign(const char* id, const std::string& text, const HeardById& frames, Time stopped) {
  Cause cause{id, text, {}, {}, stopped};
  for (const auto& [identifier, one] : frames) {
    cause.since = std::min(cause.since, one.first);
    cause.supports.push_back(fmt::format("{} arrived {} time{}, first at {}", controllers_frame_text(identifier),
                                         one.times, one.times == 1 ? "" : "s", at_text(one.first)));
  }
  cause.supports.emplace_back("the controller does not receive its own frames: somebody else sent these");
  cause.against.emplace_back("another program on this computer and another device on the bus look the same");
  return cause;
}

Cause other_controller(const Stop& stop, const Window& window, const MachineDescription& machine) {
  std::vector<std::uint32_t> own = slave::controllers_own(machine.bus);
  const std::vector<std::uint32_t> set_points = slave::set_point_ids(machine.bus);
  own.insert(own.end(), set_points.begin(), set_points.end());
  const auto wanted = [&](std::uint32_t id) { return std::find(own.begin(), own.end(), id) != own.end(); };
  return by_foreign("other_controller",
                    "another controller is on the machine's bus: stop one of the two, as each may reset the nodes that "
                    "the other leads",
                    heard(window, stop, wanted), stop.at);
}

Cause foreign_sender(const Stop& stop, const Window& window, const MachineDescription& machine) {
  const auto id = static_cast<std::uint32_t>(stop.reason.value);
  return by_foreign("foreign_sender",
                    node_text(machine, stop.reason.subject) +
                        " is commanded by somebody else on the bus: find the sender and take it off",
                    heard(window, stop, [id](std::uint32_t one) { return one == id; }), stop.at);
}

Cause node_id_twice(const Stop& stop, const Window& window, const MachineDescription& machine) {
  const std::uint8_t node = stop.reason.subject;
  Cause cause{"node_id_twice",
              "two devices send under the node id of " + node_text(machine, node) +
                  ": take one off the bus, or give it another id; until then either one's values may have been used",
              {},
              {},
              stop.at};
  const std::vector<NamedNode> nodes = named_nodes(machine.bus);
  const auto twin =
      std::find_if(nodes.begin(), nodes.end(), [node](const NamedNode& one) { return one.node.id == node; });
  const auto from_node = [&](std::uint32_t id) {
    const bool process_data = twin != nodes.end() && id == twin->node.tpdo_id();
    return process_data || id == canopen::heartbeat_id(node) || id == canopen::emcy_id(node) ||
           id == canopen::sdo_response_id(node);
  };
  const auto syncs = std::count_if(window.can.begin(), window.can.end(), [&](const CanSeen& can) {
    return can.kind == WireEventKind::kCanSent && can.frame.id == canopen::kSyncId &&
           can.at >= stop.at - Evidence::kBefore && can.at <= stop.at + Evidence::kAfter;
  });
  for (const auto& [identifier, one] : heard(window, stop, from_node))
    cause.supports.push_back(
        fmt::format("0x{:03X} arrived {} times while SYNC was sent {} times", identifier, one.times, syncs));
  cause.against.emplace_back("a tool that sends in the node's name looks the same as a second device");
  return cause;
}

}  // namespace

std::optional<Cause> bus_cause(const Stop& stop, const Window& window, const MachineDescription& machine) {
  switch (stop.reason.code) {
    case ReasonCode::kOtherController:
      return other_controller(stop, window, machine);
    case ReasonCode::kForeignSender:
      return foreign_sender(stop, window, machine);
    case ReasonCode::kNodeIdTwice:
      return node_id_twice(stop, window, machine);
    default:
      return std::nullopt;
  }
}

}  // namespace knuckle::explain
