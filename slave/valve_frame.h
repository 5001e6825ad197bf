// The one place where a valve command becomes a frame: it takes only what a gate has let pass, or neutral.
#pragma once

#include <cstddef>
#include <cstdint>

#include "machine/description.h"
#include "slave/safety_gate.h"
#include "transport/can_bus.h"
#include "transport/canopen.h"

namespace knuckle::slave {

/// @param joint 0...2. @param control_word as CiA 408 has it.
[[nodiscard]] inline CanFrame valve_frame(const BusDescription& bus, int joint, std::uint16_t control_word,
                                          const PassedCommands& commands) noexcept {
  const NodeDescription& valve = bus.valves[static_cast<std::size_t>(joint)];
  return canopen::valve_command_frame(valve.rpdo_id(), {control_word, commands[joint]}, bus.wire.valve_full_stroke);
}

}  // namespace knuckle::slave
