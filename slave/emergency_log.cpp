#include "slave/emergency_log.h"

#include <cstdio>

namespace knuckle::slave {

std::string text(const EmergencyRecord& record) {
  std::array<char, 128> line{};
  std::snprintf(line.data(), line.size(), "node 0x%02X: 0x%04X %s (error register 0x%02X)", unsigned{record.node},
                unsigned{record.emergency.code}, canopen::emergency_text(record.emergency.code),
                unsigned{record.emergency.error_register});
  return line.data();
}

}  // namespace knuckle::slave
