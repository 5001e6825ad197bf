#include "sim/can_nodes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "transport/bytes.h"

namespace knuckle::sim {

using canopen::ValveState;

namespace {

constexpr double kFollowingLimit = 0.1;  // of spool stroke
constexpr Duration kFollowingTime = 100ms;
constexpr double kWindBack_mps = 1.5;
constexpr double kTurnAway_radps = 5;
constexpr std::uint8_t kEverySync = 1;
constexpr std::uint16_t kPvedRpdoTimeout = 0x81FF;
constexpr canopen::Object kEncoderOffset{0x6509, 0};  // i32 steps, what a preset has added

std::uint32_t bits(std::int32_t value) noexcept {
  return static_cast<std::uint32_t>(value);
}
std::uint32_t bits(std::int16_t value) noexcept {
  return static_cast<std::uint16_t>(value);
}

const canopen::PdoMap& map_of(SensorNode::Kind kind) noexcept {
  switch (kind) {
    case SensorNode::Kind::kPressure:
      return canopen::kPressureTpdo;
    case SensorNode::Kind::kEncoder:
      return canopen::kEncoderTpdo;
    case SensorNode::Kind::kRotary:
      return canopen::kRotaryTpdo;
    case SensorNode::Kind::kTilt:
      break;
  }
  return canopen::kTiltTpdo;
}

/// How far off a spike is: far beyond noise, inside the sensor's range.
double spike_of(SensorNode::Kind kind) noexcept {
  switch (kind) {
    case SensorNode::Kind::kPressure:
      return 1.5e7;
    case SensorNode::Kind::kEncoder:
    case SensorNode::Kind::kRotary:
      return 0.1;
    case SensorNode::Kind::kTilt:
      break;
  }
  return 0.3;
}

ValveState asked_state(std::uint32_t control_word) noexcept {
  if ((control_word & 1U) == 0) return ValveState::kInit;
  if ((control_word & 2U) == 0) return ValveState::kDisabled;
  return (control_word & 4U) == 0 ? ValveState::kHold : ValveState::kActive;
}

}  // namespace

// ---- Valve
// -----------------------------------------------------------------------------------------------------------

namespace {

/// A driver of several axes has its PDOs in a row.
std::vector<canopen::PdoMap> valve_rpdos(std::size_t axes) {
  std::vector<canopen::PdoMap> maps(axes > 1 ? NodeDescription::kMostPdos : 1);
  maps[0] = canopen::kValveRpdo;
  return maps;
}

}  // namespace

ValveNode::ValveNode(const NodeDescription& identity, double full_stroke)
    : profile_(identity.profile),
      protocol_(identity, {canopen::kValveTpdo}, kEverySync, valve_rpdos(identity.channels.back().number)),
      full_stroke_(full_stroke) {
  for (unsigned number = 1; number <= identity.channels.back().number; ++number) {
    const auto add = [&](canopen::Object object, std::uint8_t size, Access access, std::uint32_t value = 0) {
      return protocol_.add(of_axis(object, number), size, access, value);
    };
    axes_.push_back({.control = add(canopen::kValveControlWord, 2, Access::kReadWrite),
                     .status = add(canopen::kValveStatusWord, 2, Access::kReadOnly),
                     .mode = add(canopen::kValveControlMode, 1, Access::kReadWrite, 1),
                     .set_point = add(canopen::kValveSetPoint, 2, Access::kReadWrite),
                     .actual = add(canopen::kValveActual, 2, Access::kReadOnly)});
  }
}

void ValveNode::step(Time now, const Spools& spools, Outbox& out) noexcept {
  const bool reset = protocol_.take_reset();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    if (reset) {
      axis.state = ValveState::kInit;
      axis.faulted = axis.reset_bit = false;
    }
    if (protocol_.take_written_axis(i)) obey_control_word(axis);
    if (!protocol_.operational() && axis.state != ValveState::kInit) axis.state = ValveState::kDisabled;
  }
  watch(now, out);
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    put(axes_[i], spools[i]);
    if (fault_ == NodeFault::kStuck) axes_[i].demand = stuck_at_[i];
  }
  protocol_.set_error(std::any_of(axes_.begin(), axes_.end(), [](const Axis& axis) { return axis.faulted; }));
  protocol_.step(now, out);
}

void ValveNode::put(Axis& axis, double spool) noexcept {
  const bool from_bus = protocol_.value(axis.mode) == 1;
  const bool active = protocol_.operational() && axis.state == ValveState::kActive && !axis.faulted && from_bus;
  const auto set_point = static_cast<std::int16_t>(protocol_.value(axis.set_point));
  axis.demand = active ? std::clamp(set_point / full_stroke_, -1.0, 1.0) : 0.0;
  if (fault_ == NodeFault::kFrozen) return;
  protocol_.set(axis.status, static_cast<std::uint32_t>(axis.state) |
                                 (axis.faulted ? 0U : unsigned{canopen::kStatusReady}) |
                                 (from_bus ? 0U : unsigned{canopen::kStatusLocal}));
  const auto actual = fault_ == NodeFault::kInvalid ? std::numeric_limits<std::int16_t>::max()
                                                    : canopen::to_steps<std::int16_t>(spool, 1 / full_stroke_);
  protocol_.set(axis.actual, bits(actual));
}

// Upwards one state a command, downwards at once; a fault is left by a rising edge of the reset bit without bit 2.
void ValveNode::obey_control_word(Axis& axis) noexcept {
  const std::uint32_t word = protocol_.value(axis.control);
  if (profile_ == ValveProfile::kPved) return obey_pved(axis, word);
  const bool reset = (word & canopen::kControlReset) != 0;
  if (axis.faulted && reset && !axis.reset_bit && (word & 4U) == 0) {
    axis.faulted = false;
    axis.state = ValveState::kInit;
  }
  axis.reset_bit = reset;
  if (axis.faulted) return;
  const auto asked = static_cast<unsigned>(asked_state(word));
  const auto next = static_cast<unsigned>(axis.state) << 1 | 1U;
  axis.state = static_cast<ValveState>(std::min(asked, next));
}

// A PVED-CC takes 0x08, 0x09, 0x0B, 0x0F one after the other; a fault is left by 0x03, then 0x0B.
void ValveNode::obey_pved(Axis& axis, std::uint32_t word) noexcept {
  const std::uint32_t last = std::exchange(axis.last_word, word);
  if (axis.faulted) {
    if (last != 0x03 || word != 0x0B) return;
    axis.faulted = false;
    axis.state = ValveState::kInit;
    return;
  }
  if ((word & 0x08U) == 0) {
    axis.state = ValveState::kInit;
    return;
  }
  const auto next = static_cast<unsigned>(axis.state) << 1 | 1U;
  axis.state = static_cast<ValveState>(std::min(static_cast<unsigned>(asked_state(word)), next));
}

// The valve's own watchdogs: without controller all axes go to neutral, without set-points theirs; and it says so.
void ValveNode::watch(Time now, Outbox& out) noexcept {
  if (fault_ == NodeFault::kDeadGuard) return;
  const bool alone = protocol_.heartbeat_lost(now);
  bool missed = false, stopped = false;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Axis& axis = axes_[i];
    const bool rpdo_lost = !axis.faulted && protocol_.operational() && protocol_.rpdo_lost(now, i);
    missed = missed || rpdo_lost;
    if (axis.faulted || !(rpdo_lost || alone)) continue;
    axis.faulted = stopped = true;
    axis.state = ValveState::kDisabled;
  }
  if (missed) protocol_.emergency(profile_ == ValveProfile::kPved ? kPvedRpdoTimeout : canopen::kEmcyRpdoTimeout, out);
  if (stopped) protocol_.communication_error();
}

// ---- Sensors
// ---------------------------------------------------------------------------------------------------------

SensorNode::SensorNode(Kind kind, const NodeDescription& identity, double resolution, double range,
                       const WireDescription& wire, unsigned channels)
    : kind_(kind),
      resolution_(resolution),
      range_(range),
      rotary_(identity.rotary),
      protocol_(identity, {map_of(kind)}, kEverySync) {
  const bool lateral = !identity.channels.empty() && identity.channels.front().number == 2;
  switch (kind) {
    case Kind::kPressure:
      for (unsigned n = 1; n <= channels; ++n) add_pressure(static_cast<std::uint8_t>(n), wire);
      break;
    case Kind::kEncoder:
      objects_ = {protocol_.add(canopen::kEncoderPosition, 4, Access::kReadOnly),
                  protocol_.add(canopen::kEncoderSpeed, 2, Access::kReadOnly),
                  protocol_.add(canopen::kEncoderStep, 4, Access::kReadWrite,
                                canopen::encoder_step_object(resolution > 0 ? resolution : canopen::kEncoderStep_m)),
                  protocol_.add(canopen::kEncoderSpeedStep, 4, Access::kReadWrite,
                                static_cast<std::uint32_t>(std::lround(wire.encoder_speed_step_mps / 1e-5)))};
      break;
    case Kind::kRotary:
      objects_ = {protocol_.add(canopen::kEncoderPosition, 4, Access::kReadOnly),
                  protocol_.add(canopen::kEncoderStepsPerTurn, 4, Access::kReadWrite, rotary_.steps_per_turn),
                  protocol_.add(canopen::kEncoderRange, 4, Access::kReadWrite, rotary_.range())};
      break;
    case Kind::kTilt:
      // Of two axes, one of which stays level.
      if (lateral) protocol_.add(canopen::kTiltSlope, 2, Access::kReadOnly);
      objects_ = {protocol_.add(lateral ? canopen::kTiltLateral : canopen::kTiltSlope, 2, Access::kReadOnly),
                  protocol_.add(canopen::kTiltResolution, 2, Access::kReadWrite,
                                canopen::tilt_step_object(resolution > 0 ? resolution : canopen::kTiltStep_rad))};
      break;
  }
  if (!is_encoder()) return;
  preset_ = protocol_.add(canopen::kEncoderPreset, 4, Access::kReadWrite);
  offset_ = protocol_.add(kEncoderOffset, 4, Access::kReadOnly);
}

void SensorNode::add_pressure(std::uint8_t channel, const WireDescription& wire) {
  const auto add = [&](canopen::Object of_first, std::uint8_t size, std::uint32_t value = 0) {
    return protocol_.add({of_first.index, channel}, size, Access::kReadOnly, value);
  };
  add(canopen::kPressureUnit, 4, canopen::kUnitBar);
  pressures_.push_back({.value = add(canopen::kPressureValue, 4),
                        .short_value = add(canopen::kPressureShort, 2),
                        .float_value = add(canopen::kPressureFloat, 4),
                        .status = add(canopen::kPressureStatus, 1),
                        .digits = add(canopen::kPressureDigits, 1, static_cast<std::uint32_t>(wire.pressure_digits))});
}

void SensorNode::inject(NodeFault fault, Time now) noexcept {
  fault_ = fault;
  fault_at_ = now;
}

// The offset is what a device keeps when it is told to save; the position follows it from the next sample on.
void SensorNode::obey_preset() noexcept {
  const auto here = static_cast<std::int32_t>(protocol_.value(objects_[0]) - protocol_.value(offset_));
  protocol_.set(offset_, protocol_.value(preset_) - static_cast<std::uint32_t>(here));
}

void SensorNode::step(Time now, std::span<const Sample> samples, Outbox& out) noexcept {
  if (is_encoder() && protocol_.take_written(canopen::kEncoderPreset)) obey_preset();
  if (fault_ == NodeFault::kInvalid) {
    put_invalid();
  } else if (fault_ != NodeFault::kFrozen && protocol_.samples_now()) {
    for (std::size_t i = 0; i < samples.size(); ++i) put(i, disturbed(samples[i], now));
    if (fault_ == NodeFault::kSpike && protocol_.operational()) fault_ = NodeFault::kNone;
  }
  protocol_.step(now, out);
}

SensorNode::Sample SensorNode::disturbed(const Sample& sample, Time now) const noexcept {
  Sample seen = sample;
  if (fault_ == NodeFault::kSpike && protocol_.operational()) {
    seen.value += spike_of(kind_);
  } else if (fault_ == NodeFault::kBrokenWire && kind_ == Kind::kRotary) {
    seen.value = sample.value - kTurnAway_radps * to_seconds(now - fault_at_);
  } else if (fault_ == NodeFault::kBrokenWire) {
    seen.value = std::max(0.0, sample.value - kWindBack_mps * to_seconds(now - fault_at_));
    seen.rate = seen.value > 0 ? -kWindBack_mps : 0.0;
  }
  if (resolution_ > 0) seen.value = std::round(seen.value / resolution_) * resolution_;
  return seen;
}

void SensorNode::put(std::size_t channel, const Sample& sample) noexcept {
  switch (kind_) {
    case Kind::kPressure:
      if (channel < pressures_.size()) put_pressure(pressures_[channel], sample.value);
      break;
    case Kind::kEncoder:
      put_encoder(sample);
      break;
    case Kind::kRotary:
      put_rotary(sample.value);
      break;
    case Kind::kTilt:
      put_tilt(sample.value);
      break;
  }
}

void SensorNode::put_pressure(const PressureChannel& channel, double pressure_Pa) noexcept {
  const unsigned status = (pressure_Pa > 1.02 * range_ ? unsigned{canopen::kPressureOverload} : 0U) |
                          (pressure_Pa < -0.02 * range_ ? unsigned{canopen::kPressureUnderload} : 0U);
  const auto digits = static_cast<int>(protocol_.value(channel.digits));
  const double step_Pa = kBar / std::pow(10, digits);
  const auto value = canopen::to_steps<std::int32_t>(pressure_Pa, step_Pa);
  using Short = std::numeric_limits<std::int16_t>;
  protocol_.set(channel.value, bits(value));
  protocol_.set(channel.short_value,
                bits(static_cast<std::int16_t>(std::clamp<std::int32_t>(value, Short::min(), Short::max()))));
  protocol_.set(channel.float_value, std::bit_cast<std::uint32_t>(static_cast<float>(pressure_Pa / 1e5)));
  protocol_.set(channel.status, status);
}

void SensorNode::put_encoder(const Sample& sample) noexcept {
  const double step_m = protocol_.value(objects_[2]) * 1e-9;
  const double speed_step_mps = protocol_.value(objects_[3]) * 1e-5;
  const auto offset = static_cast<std::int32_t>(protocol_.value(offset_));
  protocol_.set(objects_[0], bits(canopen::to_steps<std::int32_t>(sample.value, step_m) + offset));
  protocol_.set(objects_[1], bits(canopen::to_steps<std::int16_t>(sample.rate, speed_step_mps)));
}

void SensorNode::put_rotary(double shaft_rad) noexcept {
  const double step_rad = 2 * std::numbers::pi / protocol_.value(objects_[1]);
  const auto range = std::max<std::int64_t>(1, protocol_.value(objects_[2]));
  const auto offset = static_cast<std::int32_t>(protocol_.value(offset_));
  const std::int64_t counted = std::llround(rotary_.sign * (shaft_rad - rotary_.zero_rad) / step_rad) + offset;
  protocol_.set(objects_[0], static_cast<std::uint32_t>((counted % range + range) % range));
}

void SensorNode::put_tilt(double slope_rad) noexcept {
  const double step_rad = protocol_.value(objects_[1]) * 1e-3 * std::numbers::pi / 180;
  protocol_.set(objects_[0], bits(canopen::to_steps<std::int16_t>(slope_rad, step_rad)));
}

void SensorNode::put_invalid() noexcept {
  constexpr auto kLargest = std::numeric_limits<std::int32_t>::max();
  constexpr auto kLargestShort = std::numeric_limits<std::int16_t>::max();
  for (const PressureChannel& channel : pressures_) {
    protocol_.set(channel.value, bits(kLargest));
    protocol_.set(channel.short_value, bits(kLargestShort));
    protocol_.set(channel.float_value, std::bit_cast<std::uint32_t>(std::numeric_limits<float>::quiet_NaN()));
    protocol_.set(channel.status, canopen::kPressureInvalid);
  }
  if (is_encoder()) protocol_.set(objects_[0], bits(kLargest));
  if (kind_ == Kind::kTilt) protocol_.set(objects_[0], bits(kLargestShort));
}

// ---- Machine enable
// --------------------------------------------------------------------------------------------------

EnableNode::EnableNode(const BusDescription& bus)
    : protocol_(bus.enable(), {canopen::kEnableTpdo}, canopen::kEventDriven, {canopen::kEnableRpdo}),
      inputs_(protocol_.add(canopen::kEnableInputs, 1, Access::kReadOnly)),
      outputs_(protocol_.add(canopen::kEnableOutputs, 1, Access::kReadWrite)),
      full_stroke_(bus.wire.valve_full_stroke) {
  for (std::size_t j = 0; !bus.by_frames() && j < kJoints; ++j) {
    set_point_ids_[j] = bus.set_point_id(j);
    spool_ids_[j] = bus.spool_id(j);
  }
}

void EnableNode::observe(const CanFrame& frame) noexcept {
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (frame.id == set_point_ids_[j]) {
      if (const auto command = canopen::parse_valve_command(frame, full_stroke_)) {
        const bool active = asked_state(command->control_word) == ValveState::kActive;
        demand_[j] = active ? command->set_point : 0.0;
      }
    } else if (frame.id == spool_ids_[j]) {
      if (const auto status = canopen::parse_valve_status(frame, full_stroke_)) {
        actual_[j] = status->spool;
        valve_fault_[j] = canopen::valve_fault(status->status_word);
      }
    }
  }
}

void EnableNode::step(Time now, Outbox& out) noexcept {
  if (protocol_.take_reset()) latched_ = false;
  const bool asked = (protocol_.value(outputs_) & canopen::kOutputEnable) != 0;
  if (!asked || !latches_) latched_ = false;
  if (asked && !latched_ && !allowed(now, out)) latched_ = true;
  pilot_ = asked && !latched_;
  if (!pilot_) apart_since_.fill(Time::max());
  protocol_.set_error(latched_);
  protocol_.set(
      inputs_, (estop_ ? 0U : unsigned{canopen::kInputEStopClosed}) | (pilot_ ? unsigned{canopen::kInputPilotOn} : 0U));
  protocol_.step(now, out);
}

// The open E-stop chain is told by the input itself, a missing heartbeat by the protocol: no EMCY of their own.
bool EnableNode::allowed(Time now, Outbox& out) noexcept {
  const bool guarded = fault_ != NodeFault::kDeadGuard;
  if (estop_ || !protocol_.operational() || (guarded && protocol_.heartbeat_lost(now))) return false;
  if (guarded && protocol_.rpdo_lost(now)) {
    protocol_.emergency(canopen::kEmcyRpdoTimeout, out);
    return false;
  }
  if (following(now)) return true;
  protocol_.emergency(canopen::kEmcyDeviceSpecific, out);
  return false;
}

// A sound spool lags its demand by some 70 ms (bus, delay, spring), so it is held against the span of the newest
// demands (80 ms of them): against the last one alone, a demand that moves at 1.5 of stroke a second would look stuck.
// A valve in fault closes by itself, in the same time.
bool EnableNode::following(Time now) noexcept {
  const bool due = demands_at_ == kNever || now - demands_at_ >= 10ms;
  if (due) {
    demands_at_ = now;
    ++next_demand_;
  }
  bool good = true;
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (due) demands_[j][next_demand_ % kDemands] = demand_[j];
    const auto [least, most] = std::minmax_element(demands_[j].begin(), demands_[j].end());
    const double low = valve_fault_[j] ? 0 : std::min(*least, demand_[j]);
    const double high = valve_fault_[j] ? 0 : std::max(*most, demand_[j]);
    if (actual_[j] >= low - kFollowingLimit && actual_[j] <= high + kFollowingLimit) {
      apart_since_[j] = Time::max();
      continue;
    }
    if (apart_since_[j] == Time::max()) apart_since_[j] = now;
    good = good && now - apart_since_[j] < kFollowingTime;
  }
  return good;
}

}  // namespace knuckle::sim
