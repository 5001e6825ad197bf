#include "slave/bus_map.h"

#include "slave/canopen_client.h"
#include "slave/node_setup.h"
#include "transport/canopen.h"

namespace knuckle::slave {
std::vector<NodeDescription> nodes_of(const BusDescription& bus) {
  std::vector<NodeDescription> nodes(bus.valves.begin(), bus.valves.end());
  nodes.insert(nodes.end(), bus.pressures.begin(), bus.pressures.end());
  nodes.insert(nodes.end(), bus.encoders.begin(), bus.encoders.end());
  nodes.push_back(bus.tilt);
  nodes.push_back(bus.enable);
  return nodes;
}

std::vector<PeriodicFrame> bus_map(const BusDescription& bus) {
  std::vector<PeriodicFrame> map;
  const auto sends = [&](const NodeDescription& node, const canopen::PdoMap& pdo, double rate_Hz) {
    map.push_back({node.tpdo_id(), canopen::bytes_of(pdo), rate_Hz});
  };
  const auto hears = [&](const NodeDescription& node, const canopen::PdoMap& pdo, double rate_Hz) {
    map.push_back({node.rpdo_id(), canopen::bytes_of(pdo), rate_Hz});
  };
  map.push_back({canopen::kSyncId, 0, bus.sync_Hz});
  for (const NodeDescription& valve : bus.valves) {
    sends(valve, canopen::kValveTpdo, bus.sync_Hz / bus.valve_status_every_nth_sync);
    hears(valve, canopen::kValveRpdo, bus.sync_Hz / bus.set_point_every_nth_sync);
  }
  for (const NodeDescription& pressure : bus.pressures) sends(pressure, pressure_map(bus.wire), bus.sync_Hz);
  for (const NodeDescription& encoder : bus.encoders) sends(encoder, canopen::kEncoderTpdo, bus.sync_Hz);
  sends(bus.tilt, canopen::kTiltTpdo, bus.sync_Hz / bus.tilt_every_nth_sync);
  sends(bus.enable, canopen::kEnableTpdo, 1 / bus.controller_heartbeat_s);
  hears(bus.enable, canopen::kEnableRpdo, bus.sync_Hz / CanopenClient::kEnableEveryNthSync);
  map.push_back({canopen::heartbeat_id(bus.controller_id), 1, 1 / bus.controller_heartbeat_s});
  for (const NodeDescription& node : nodes_of(bus))
    map.push_back({canopen::heartbeat_id(node.id), 1, 1 / bus.node_heartbeat_s});
  return map;
}

std::vector<std::uint32_t> controllers_own(const BusDescription& bus) {
  return {canopen::kNmtId, canopen::kSyncId, canopen::heartbeat_id(bus.controller_id)};
}

std::vector<std::uint32_t> set_point_ids(const BusDescription& bus) {
  std::vector<std::uint32_t> ids;
  for (const NodeDescription& valve : bus.valves) ids.push_back(valve.rpdo_id());
  ids.push_back(bus.enable.rpdo_id());
  return ids;
}

std::vector<std::uint32_t> heard_by_controller(const BusDescription& bus) {
  std::vector<std::uint32_t> ids = controllers_own(bus);
  const std::vector<std::uint32_t> set_points = set_point_ids(bus);
  ids.insert(ids.end(), set_points.begin(), set_points.end());
  for (const NodeDescription& node : nodes_of(bus)) {
    for (const std::uint32_t id : {node.tpdo_id(), canopen::heartbeat_id(node.id), canopen::emcy_id(node.id),
                                   canopen::sdo_response_id(node.id), canopen::sdo_request_id(node.id)})
      ids.push_back(id);
  }
  return ids;
}

}  // namespace knuckle::slave
