#include "machine/set_points.h"

#include <algorithm>
#include <cmath>

#include "transport/canopen.h"

namespace knuckle {
namespace {

/// Likewise with the way in bits beside it. Any way but the three that are known, such as float, is as far as can be.
double directed(const CommandField& field, const CanFrame& frame) noexcept {
  const CommandDirection& direction = *field.direction;
  const auto way = read_raw(direction.bits, frame), raw = read_raw(field.bits, frame);
  if (way != direction.neutral && way != direction.extend && way != direction.retract) return 1;
  if (way == direction.neutral || raw == raw_of(field.bits, field.neutral)) return 0;
  const double above = value_of(field.bits, raw.value_or(0)) - field.neutral;
  return way == direction.extend ? above / (*field.extend - field.neutral) : -above / (*field.retract - field.neutral);
}

/// [-1, 1] by what one field says; 0 where its bits are those of neutral.
double command_of(const CommandField& field, const CanFrame& frame) noexcept {
  if (field.direction) return directed(field, frame);
  const auto raw = read_raw(field.bits, frame);
  if (!raw || *raw == raw_of(field.bits, field.neutral)) return 0;
  const double above = value_of(field.bits, *raw) - field.neutral;
  const auto share = [&](const std::optional<double>& full) {
    return full ? std::max(0.0, above / (*full - field.neutral)) : 0;
  };
  const double extends = share(field.extend), retracts = share(field.retract);
  if (extends > 0) return extends;
  return retracts > 0 ? -retracts : above;  // the way that this field has no meaning for: not neutral
}

}  // namespace

std::optional<double> set_point_in(const CanFrame& frame, int joint, const BusDescription& bus) noexcept {
  if (!bus.by_frames()) {
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
      if (field.joint != joint || bytes_of(field.bits) > frame.size) continue;
      const double command = command_of(field, frame);  // of two valves at once the further one: it is not neutral
      if (!told || std::abs(command) > std::abs(*told)) told = command;
    }
  }
  return told;
}

}  // namespace knuckle
