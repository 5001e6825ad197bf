#include "slave/bus_map.h"

#include <algorithm>

#include "machine/bus_frames.h"
#include "transport/canopen.h"
#include "transport/j1939.h"

namespace knuckle::slave {

std::vector<std::uint32_t> controllers_own(const BusDescription& bus) {
  const bool unknown = bus.broadcasts.empty() && bus.commands.empty();  // as for who gives a device its node id
  if (bus.without_nodes() && !unknown) return {};
  return {canopen::kNmtId, canopen::kSyncId, canopen::heartbeat_id(bus.controller_id)};
}

std::vector<CanFilter> set_point_filters(const BusDescription& bus) {
  std::vector<CanFilter> filters;
  for (const BusFrame& frame : bus_frames(bus)) {
    if (frame.to_node) filters.emplace_back(frame.id);
  }
  for (const CommandFrame& frame : bus.commands) filters.push_back(frame.filter());
  return filters;
}

std::vector<CanFilter> packet_filters(const BusDescription& bus) {
  std::vector<CanFilter> filters;
  for (const BroadcastFrame& frame : bus.broadcasts) {
    if (!j1939::in_packets(frame.bytes)) continue;
    for (const std::uint32_t group : {j1939::kConnection, j1939::kTransfer}) {
      const CanFilter parts(j1939::identifier(group, 0) | (frame.id & kSecondBus), j1939::kAllButPriorityAndSource);
      if (std::find(filters.begin(), filters.end(), parts) == filters.end()) filters.push_back(parts);
    }
  }
  return filters;
}

bool hears(const std::vector<CanFilter>& filters, std::uint32_t id) noexcept {
  return std::any_of(filters.begin(), filters.end(), [id](const CanFilter& filter) { return filter.lets(id); });
}

std::vector<CanFilter> heard_by_controller(const BusDescription& bus) {
  const std::vector<std::uint32_t> own = controllers_own(bus);
  std::vector<CanFilter> ids(own.begin(), own.end());
  const std::vector<CanFilter> set_points = set_point_filters(bus);
  ids.insert(ids.end(), set_points.begin(), set_points.end());
  for (const BusFrame& frame : bus_frames(bus)) {
    if (!frame.to_node) ids.emplace_back(frame.id);
  }
  for (const BroadcastFrame& frame : bus.broadcasts)
    if (std::find(ids.begin(), ids.end(), frame.filter()) == ids.end()) ids.push_back(frame.filter());
  const std::vector<CanFilter> packets = packet_filters(bus);
  ids.insert(ids.end(), packets.begin(), packets.end());
  if (bus.j1939_address) {
    for (const std::uint32_t group : {j1939::kRequest, j1939::kAddressClaim})
      ids.emplace_back(j1939::identifier(group, 0), j1939::group_mask(group));
  }
  for (const NodeDescription& node : bus.nodes) {
    for (const std::uint32_t id : {canopen::heartbeat_id(node.id), canopen::emcy_id(node.id),
                                   canopen::sdo_response_id(node.id), canopen::sdo_request_id(node.id)})
      ids.emplace_back(id);
  }
  return ids;
}

}  // namespace knuckle::slave
