#include "slave/bus_map.h"

#include <algorithm>

#include "machine/bus_frames.h"
#include "transport/canopen.h"
#include "transport/j1939_packets.h"

namespace knuckle::slave {
namespace {

constexpr std::uint8_t kMostBytes = sizeof(CanFrame::data);

}  // namespace

std::vector<PeriodicFrame> bus_map(const BusDescription& bus) {
  std::vector<PeriodicFrame> map;
  const bool nodes = !bus.without_nodes();
  if (nodes) map.push_back({canopen::kSyncId, 0, bus.sync_Hz});
  for (const BusFrame& frame : bus_frames(bus)) map.push_back({frame.id, frame.bytes(), frame.rate_Hz(bus.sync_Hz)});
  if (nodes) map.push_back({canopen::heartbeat_id(bus.controller_id), 1, 1 / bus.controller_heartbeat_s});
  for (const NodeDescription& node : bus.nodes)
    map.push_back({canopen::heartbeat_id(node.id), 1, 1 / bus.node_heartbeat_s});
  for (const BroadcastFrame& frame : bus.broadcasts) {
    if (j1939::in_packets(frame.bytes)) {
      const auto part = [&](std::uint32_t group, unsigned times) {
        const std::uint32_t id = j1939::identifier(group, j1939::source_of(frame.id)) | (frame.id & kSecondBus);
        map.push_back({id, kMostBytes, times / frame.period_s});
      };
      part(j1939::kConnection, 1);
      part(j1939::kTransfer, j1939::packets_of(frame.bytes));
      continue;
    }
    const auto known =
        std::find_if(map.begin(), map.end(), [&](const PeriodicFrame& other) { return other.id == frame.id; });
    if (known == map.end())
      map.push_back({frame.id, frame.bytes, 1 / frame.period_s});
    else  // a multiplexer tells them apart
      known->rate_Hz += 1 / frame.period_s;
  }
  for (const CommandFrame& frame : bus.commands) map.push_back({frame.id, frame.bytes, 1 / frame.period_s});
  return map;
}

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
