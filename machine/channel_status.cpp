#include "machine/channel_status.h"

namespace knuckle {

bool lacks_status(const std::vector<FrameField>& fields, const NodeChannel& channel) noexcept {
  return channel.info().role == NodeRole::kPressure &&
         find_field(fields, FrameField::Part::kStatus, channel) == nullptr;
}

std::string missing_status_text(const NodeDescription& node, const MachineDescription& machine) {
  const std::vector<FrameField> fields = sent_fields(node, machine);
  std::string names;
  for (const NodeChannel& channel : node.channels)
    if (lacks_status(fields, channel)) names += (names.empty() ? "" : ", ") + std::string(channel.info().name);
  if (names.empty()) return "";
  return "sends " + names +
         " without status (0x6150): a broken transmitter is found only where the value leaves its range or "
         "contradicts the others";
}

}  // namespace knuckle
