#include "slave/command_frames.h"

#include <algorithm>
#include <cmath>

namespace knuckle::slave {
namespace {

constexpr Duration kEarly = 500us;  // of a step that comes a little before its time

/// No further from neutral than asked: what a gate has capped is not rounded up again.
double towards_neutral(const CommandField& field, double value) noexcept {
  constexpr double kDust = 1e-9;  // of a step
  if (field.bits.type == BitField::Type::kFloat) return value;
  const double steps = (value - field.neutral) / field.bits.scale;
  return field.neutral + std::trunc(steps + std::copysign(kDust, steps)) * field.bits.scale;
}

/// No way where the value is neutral, be it by its rounding.
std::uint64_t way(const CommandField& field, std::uint64_t raw, double command) noexcept {
  if (raw == raw_of(field.bits, field.neutral)) return field.direction->neutral;
  return command > 0 ? field.direction->extend : field.direction->retract;
}

}  // namespace

CommandFrames::CommandFrames(const BusDescription& bus) {
  for (const CommandFrame& frame : bus.commands) frames_.push_back({frame, from_seconds(frame.period_s)});
}

void CommandFrames::go_on_from(const CommandFrames& before) noexcept {
  for (std::size_t i = 0; i < std::min(frames_.size(), before.frames_.size()); ++i)
    frames_[i].count = before.frames_[i].count;
  demand_ = before.demand_;
  led_ = before.led_;
}

/// Whether it has a joint that moves, and is to move no more: that does not wait for its period.
bool CommandFrames::stops(const CommandFrame& frame, const PassedCommands& commands,
                          const JointVector& demand) noexcept {
  return std::any_of(frame.fields.begin(), frame.fields.end(), [&](const CommandField& field) {
    return field.joint && commands[*field.joint] == 0 && demand[*field.joint] != 0;
  });
}

void CommandFrames::step(const PassedCommands& commands, bool led, CanBus& bus, Time now, bool has_address,
                         std::optional<std::uint8_t> withheld) noexcept {
  const bool turned = led != led_;
  const JointVector before = demand_;
  for (Sent& one : frames_) {
    if (led) one.resting = false;
    if (one.resting && !one.frame.always) continue;
    if (one.frame.module == withheld) continue;
    if (!has_address && one.frame.mask != CanFilter::kWhole) continue;
    const bool due = one.due == kNever || now + kEarly >= one.due;
    if (!due && !turned && !stops(one.frame, commands, before)) continue;
    if (!send(one, commands, led, bus)) {
      one.due = now;
      continue;
    }
    // In step with its period; one that came too late begins a new one.
    one.due = due && one.due != kNever && now - one.due < one.period ? one.due + one.period : now + one.period;
    one.resting = !led;
    if (moves_joint(one.frame)) sent_at_ = now;
  }
  led_ = led;
}

bool CommandFrames::send(Sent& one, const PassedCommands& commands, bool led, CanBus& bus) noexcept {
  CanFrame frame{.id = one.frame.id, .size = one.frame.bytes, .data = {}};
  for (const CommandField& field : one.frame.fields) {
    const double command = field.joint ? commands[*field.joint] : 0;
    const double value = field.value(command, led);
    const std::uint64_t raw = raw_of(field.bits, field.joint ? towards_neutral(field, value) : value);
    write_raw(field.bits, raw, frame);
    if (field.direction) write_raw(field.direction->bits, way(field, raw, command), frame);
  }
  close_frame(one.frame.closing, one.count, frame);
  if (!bus.send(frame)) return false;
  if (one.frame.closing.counter) one.count = next_count(*one.frame.closing.counter, one.count);
  for (const CommandField& field : one.frame.fields)
    if (field.joint) demand_[*field.joint] = commands[*field.joint];
  return true;
}

}  // namespace knuckle::slave
