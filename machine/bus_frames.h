// Process data of the machine's nodes, derived from the machine file: which frames there are, and what lies where in
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "machine/description.h"
#include "transport/canopen.h"
#include "transport/signal_codec.h"

namespace knuckle {

/// A mapped object: what it says, and where.
struct FrameField {
  enum class Part : std::uint8_t {
    kValue,   ///< SI; of a spool, steps of the wire; of an angle, any turn of it.
    kRate,    ///< SI a second.
    kStatus,  ///< Status word, status bits, inputs: as they are.
    kControl  ///< Control word, outputs: as they are.
  } part = Part::kValue;
  NodeChannel channel;
  canopen::Object object;
  BitField bits;
};

/// One process data object.
struct BusFrame {
  std::size_t node = 0;  ///< In BusDescription::nodes.
  bool to_node = false;
  std::uint8_t pdo = 0;  ///< 0...3: 0x1800 or 0x1400 and so on.
  std::uint32_t id = 0;
  int every_nth_sync = 0;  ///< 0: when something changes, and every repeat_s.
  double repeat_s = 0;
  std::vector<FrameField> fields;     ///< In the order they are mapped in.
  std::vector<std::uint32_t> mapped;  ///< All that is mapped, as 0x1A00 says it: 0x61300120 is 32 bits of 0x6130:01.
  [[nodiscard]] std::uint8_t bytes() const noexcept;
  [[nodiscard]] double rate_Hz(double sync_Hz) const noexcept {
    return every_nth_sync > 0 ? sync_Hz / every_nth_sync : 1 / repeat_s;
  }
};

/// The transmit PDOs that this node's channels fill, from 0; may be more than there are.
[[nodiscard]] std::vector<std::uint8_t> transmit_pdos(const NodeDescription& node, const WireDescription& wire);

/// The receive PDOs that tell this node's channels what to do, from 0.
[[nodiscard]] std::vector<std::uint8_t> receive_pdos(const NodeDescription& node);

/// What this part of a channel is mapped as; null where it is not.
[[nodiscard]] const FrameField* find_field(const std::vector<FrameField>& fields, FrameField::Part part,
                                           const NodeChannel& channel) noexcept;

/// All that is known of what a node sends.
[[nodiscard]] std::vector<FrameField> sent_fields(const NodeDescription& node, const WireDescription& wire,
                                                  const SensorDescription& sensors = {});
[[nodiscard]] inline std::vector<FrameField> sent_fields(const NodeDescription& node,
                                                         const MachineDescription& machine) {
  return sent_fields(node, machine.bus.wire, machine.sensors);
}

// Which of a node's values come with the status by which it says itself that they are none.

/// A pressure (CiA 404) whose status is not in the frame of its value. Other profiles have none that is read.
[[nodiscard]] bool lacks_status(const std::vector<FrameField>& fields, const NodeChannel& channel) noexcept;

/// Which of its values those are, and what that costs, to follow the node's name; empty where there are none.
[[nodiscard]] std::string missing_status_text(const NodeDescription& node, const MachineDescription& machine);

/// Of all nodes in their order, each one's transmit PDOs before its receive PDOs.
[[nodiscard]] std::vector<BusFrame> bus_frames(const BusDescription& bus, const SensorDescription& sensors = {});

}  // namespace knuckle
