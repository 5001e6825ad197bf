#include "core/frame_words.h"

#include <fmt/format.h>

namespace knuckle {

std::string controllers_frame_text(std::uint32_t id) {
  const std::uint32_t function = id & 0x780U;
  const char* what = id == 0             ? "NMT"
                     : id == 0x080       ? "SYNC"
                     : function == 0x600 ? "SDO request"
                     : function == 0x700 ? "heartbeat"
                                         : "set-point";
  return fmt::format("{} 0x{:03X}", what, id);
}

}  // namespace knuckle
