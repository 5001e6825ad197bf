// What travels on a healthy machine bus, from the machine file alone: who sends it, and what the controller listens to.
#pragma once

#include <cstdint>
#include <vector>

#include "machine/bus_budget.h"
#include "machine/bus_description.h"

namespace knuckle::slave {

using knuckle::bus_map;

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
