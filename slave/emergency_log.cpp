#include "slave/emergency_log.h"

#include <fmt/format.h>

#include "machine/reason_text.h"

namespace knuckle::slave {

std::string text(const EmergencyRecord& record, const BusDescription& bus) {
  return fmt::format("{}: 0x{:04X} {} (error register 0x{:02X})", node_text(record.node, bus), record.emergency.code,
                     canopen::emergency_text(record.emergency.code), record.emergency.error_register);
}

}  // namespace knuckle::slave
