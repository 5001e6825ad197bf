// What travels on a healthy machine bus, from the machine file alone: for filters, bus load and documentation.
#pragma once

#include <cstdint>
#include <vector>

#include "machine/bus_description.h"
#include "transport/can_load.h"

namespace knuckle::slave {

/// Valves, pressures, encoders, tilt, enable.
[[nodiscard]] std::vector<NodeDescription> nodes_of(const BusDescription& bus);

/// Every frame of operation with its rate: SYNC, PDOs, heartbeats. EMCY and SDO come and go.
[[nodiscard]] std::vector<PeriodicFrame> bus_map(const BusDescription& bus);

/// Exact identifiers that the controller listens to: PDOs, heartbeats, EMCY and SDO answers of its nodes.
[[nodiscard]] std::vector<std::uint32_t> heard_by_controller(const BusDescription& bus);

}  // namespace knuckle::slave
