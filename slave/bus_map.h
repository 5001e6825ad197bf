// What travels on a healthy machine bus, from the machine file alone: for filters, bus load and documentation.
#pragma once

#include <cstdint>
#include <vector>

#include "machine/bus_description.h"
#include "transport/can_load.h"

namespace knuckle::slave {

/// Every frame of operation with its rate: SYNC, PDOs, heartbeats. EMCY and SDO come and go.
[[nodiscard]] std::vector<PeriodicFrame> bus_map(const BusDescription& bus);

/// NMT, SYNC and its own heartbeat: what no node sends, and another controller as well. None on a bus without nodes.
[[nodiscard]] std::vector<std::uint32_t> controllers_own(const BusDescription& bus);

/// Set-points of the valves and the output of the enable node, or command frames: what only a controller sends, too.
[[nodiscard]] std::vector<CanFilter> set_point_filters(const BusDescription& bus);

/// What the messages of several packets that the file has come in; empty where it has none.
[[nodiscard]] std::vector<CanFilter> packet_filters(const BusDescription& bus);

/// Whether any of them lets it through.
[[nodiscard]] bool hears(const std::vector<CanFilter>& filters, std::uint32_t id) noexcept;

/// What the controller listens to: what the machine sends by itself, PDOs, heartbeats, EMCY and SDO answers of its
/// nodes, and all that only it sends, because it does not hear itself and so they are somebody else's; with a J1939
/// address also claims of addresses and requests. One identifier each, but of parameter groups.
[[nodiscard]] std::vector<CanFilter> heard_by_controller(const BusDescription& bus);

}  // namespace knuckle::slave
