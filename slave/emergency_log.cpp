#include "slave/emergency_log.h"

#include <fmt/format.h>

namespace knuckle::slave {

std::string text(const EmergencyRecord& record) {
  return fmt::format("node 0x{:02X}: 0x{:04X} {} (error register 0x{:02X})", record.node, record.emergency.code,
                     canopen::emergency_text(record.emergency.code), record.emergency.error_register);
}

}  // namespace knuckle::slave
