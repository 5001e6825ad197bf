#include "machine/set_points.h"

#include <cmath>

#include "transport/canopen.h"

namespace knuckle {
namespace {

/// Of its full value one way; 0 where the field says the other way or neutral.
double share_of(const CommandField& field, const std::optional<double>& full, double value) noexcept {
  if (!full) return 0;
  const double share = (value - field.neutral) / (*full - field.neutral);
  return std::abs(share) * std::abs(*full - field.neutral) < std::abs(field.bits.scale) / 2 ? 0 : std::max(0.0, share);
}

}  // namespace

std::optional<double> set_point_in(const CanFrame& frame, int joint, const BusDescription& bus) noexcept {
  if (bus.commands.empty()) {
    if (frame.id != bus.set_point_id(joint)) return std::nullopt;
    const auto command = canopen::parse_valve_command(frame, bus.wire.valve_full_stroke);
    if (!command) return std::nullopt;
    const bool active = (command->control_word & canopen::kControlActive) == canopen::kControlActive;
    return active ? command->set_point : 0;
  }
  std::optional<double> told;
  for (const CommandFrame& sent : bus.commands) {
    if (sent.id != frame.id) continue;
    for (const CommandField& field : sent.fields) {
      if (field.joint != joint) continue;
      const auto value = read_value(field.bits, frame);
      if (value)
        told = told.value_or(0) + share_of(field, field.extend, *value) - share_of(field, field.retract, *value);
    }
  }
  return told;
}

}  // namespace knuckle
