#include "app/explain/text.h"

#include <fmt/format.h>

#include "machine/reason_text.h"
#include "transport/canopen.h"

namespace knuckle::explain {

std::string at_text(Time at) {
  return fmt::format("{:.3f} s", to_seconds(at));
}

std::string span_text(Duration span) {
  const double seconds = to_seconds(span);
  return seconds < 10 ? fmt::format("{:.0f} ms", 1e3 * seconds) : fmt::format("{:.1f} s", seconds);
}

std::string reason_text(const MachineDescription& machine, const Reason& reason) {
  std::string line = text(reason, machine.bus);
  if (reason.code == ReasonCode::kNodeEmergency) {
    const auto code = static_cast<std::uint16_t>(reason.value);
    line += fmt::format(": 0x{:04X}, {}", code, canopen::emergency_text(code));
  }
  return line;
}

}  // namespace knuckle::explain
