// The one place where a valve command becomes a frame: it takes only what a gate has let pass, or neutral.
#pragma once

#include <cstdint>

#include "machine/description.h"
#include "slave/safety_gate.h"
#include "transport/can_bus.h"
#include "transport/canopen.h"

namespace knuckle::slave {

/// Control words that lead a valve from state to state, and the two that together leave a fault: a rising edge of
/// bit 3.
struct ValveWords {
  std::uint16_t init = canopen::kControlInit, disabled = canopen::kControlDisabled, hold = canopen::kControlHold,
                active = canopen::kControlActive;
  std::uint16_t before_reset = canopen::kControlInit, reset = canopen::kControlReset;
};
[[nodiscard]] constexpr ValveWords valve_words(ValveProfile profile) noexcept {
  if (profile == ValveProfile::kPved) return {0x08, 0x09, 0x0B, 0x0F, 0x03, 0x0B};
  return {};
}

/// After a reset or power-on; 0 where a profile says nothing of it.
[[nodiscard]] constexpr double valve_boot_s(ValveProfile profile) noexcept {
  return profile == ValveProfile::kPved ? 10 : 0;
}

/// @param joint 0...2. @param control_word of valve_words().
[[nodiscard]] inline CanFrame valve_frame(const BusDescription& bus, int joint, std::uint16_t control_word,
                                          const PassedCommands& commands) noexcept {
  return canopen::valve_command_frame(bus.set_point_id(joint), {control_word, commands[joint]},
                                      bus.wire.valve_full_stroke);
}

}  // namespace knuckle::slave
