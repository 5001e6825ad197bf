#include "slave/bus_map.h"

#include "machine/bus_frames.h"
#include "transport/canopen.h"

namespace knuckle::slave {

std::vector<PeriodicFrame> bus_map(const BusDescription& bus) {
  std::vector<PeriodicFrame> map;
  const bool nodes = !bus.without_nodes();
  if (nodes) map.push_back({canopen::kSyncId, 0, bus.sync_Hz});
  for (const BusFrame& frame : bus_frames(bus)) map.push_back({frame.id, frame.bytes(), frame.rate_Hz(bus.sync_Hz)});
  if (nodes) map.push_back({canopen::heartbeat_id(bus.controller_id), 1, 1 / bus.controller_heartbeat_s});
  for (const NodeDescription& node : bus.nodes)
    map.push_back({canopen::heartbeat_id(node.id), 1, 1 / bus.node_heartbeat_s});
  for (const BroadcastFrame& frame : bus.broadcasts) map.push_back({frame.id, frame.bytes, 1 / frame.period_s});
  for (const CommandFrame& frame : bus.commands) map.push_back({frame.id, frame.bytes, 1 / frame.period_s});
  return map;
}

std::vector<std::uint32_t> controllers_own(const BusDescription& bus) {
  if (bus.without_nodes()) return {};
  return {canopen::kNmtId, canopen::kSyncId, canopen::heartbeat_id(bus.controller_id)};
}

std::vector<std::uint32_t> set_point_ids(const BusDescription& bus) {
  std::vector<std::uint32_t> ids;
  for (const BusFrame& frame : bus_frames(bus)) {
    if (frame.to_node) ids.push_back(frame.id);
  }
  for (const CommandFrame& frame : bus.commands) ids.push_back(frame.id);
  return ids;
}

std::vector<std::uint32_t> heard_by_controller(const BusDescription& bus) {
  std::vector<std::uint32_t> ids = controllers_own(bus);
  const std::vector<std::uint32_t> set_points = set_point_ids(bus);
  ids.insert(ids.end(), set_points.begin(), set_points.end());
  for (const BusFrame& frame : bus_frames(bus)) {
    if (!frame.to_node) ids.push_back(frame.id);
  }
  for (const BroadcastFrame& frame : bus.broadcasts) ids.push_back(frame.id);
  for (const NodeDescription& node : bus.nodes) {
    for (const std::uint32_t id : {canopen::heartbeat_id(node.id), canopen::emcy_id(node.id),
                                   canopen::sdo_response_id(node.id), canopen::sdo_request_id(node.id)})
      ids.push_back(id);
  }
  return ids;
}

}  // namespace knuckle::slave
