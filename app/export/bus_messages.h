// Every frame of the machine's bus and what is in it, from the machine file: the content of its DBC.
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "machine/description_fwd.h"
#include "transport/signal_codec.h"

namespace knuckle::exporting {

/// A number in a frame: physical value = raw * factor + offset, in the given unit.
struct Signal {
  BitField::Type type = BitField::Type::kUnsigned;
  BitField::Order order = BitField::Order::kLittleEndian;
  std::string name{};
  unsigned start_bit = 0, bits = 0;  ///< As BitField and DBC count.
  double factor = 1, offset = 0;
  double min = 0, max = 0;  ///< Of physical values that Knuckle sends or uses.
  std::string unit{};
  std::vector<std::pair<std::uint32_t, std::string>> values{};  ///< Names of raw values.
  std::string about{};
};

struct Message {
  std::uint32_t id = 0;
  std::string name;    ///< Of at most 32 characters, as DBC has it.
  std::string sender;  ///< Node name.
  std::vector<std::string> receivers;
  std::uint8_t size = 0;  ///< Bytes.
  std::vector<Signal> signals;
  std::optional<double> period_s;  ///< In operation; nullopt: no fixed one.
  std::string about;
};

/// The name of the node that Knuckle is.
inline constexpr const char* kController = "controller";
/// The one that sends what the machine sends by itself, and is told by command frames.
inline constexpr const char* kMachine = "machine_controller";

/// Where there are nodes, NMT, SYNC and the controller's heartbeat; then for each node of the machine file its PDOs,
/// heartbeat, EMCY and SDO. Names: NODE_TPDO1, NODE_RPDO1, NODE_heartbeat, NODE_EMCY, NODE_SDO_tx (answers),
/// NODE_SDO_rx (requests). Broadcasts and commands at last, by their names; signals of broadcasts by Knuckle's.
/// @param machine as calibrated() gives it.
[[nodiscard]] std::vector<Message> bus_messages(const MachineDescription& machine);

// The machine's bus as DBC, for tools that show or log CAN: every frame with its node, and what is in it.

/// Periods that are whole milliseconds are GenMsgCycleTime, which knows no others; the comments say all.
/// @param machine as it was read.
void write_dbc(const MachineDescription& machine, std::ostream& out);

}  // namespace knuckle::exporting
