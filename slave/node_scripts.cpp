// What each kind of node is asked and told until it is set up.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/error.h"
#include "machine/bus_frames.h"
#include "machine/description.h"
#include "machine/encoder_length.h"
#include "slave/node_setup.h"
#include "slave/valve_frame.h"
#include "transport/signal_codec.h"

namespace knuckle::slave {
namespace {

using canopen::Object;
using Kind = SetupPart::Kind;
using Match = SdoStep::Match;

std::uint32_t milliseconds(double seconds) {
  return static_cast<std::uint32_t>(std::lround(seconds * 1e3));
}

SetupPart required(Object object, std::uint32_t value, std::uint8_t size) {
  return {Kind::kRequire, {{object, value, size}}, {}};
}

SetupPart setting(Object object, std::uint32_t value, std::uint8_t size, Kind kind = Kind::kSetting) {
  return {kind, {{object, value, size}}, {{object, value, size}}};
}

/// What the device maps and lets nobody change; under the identifier that is wanted.
void add_fixed_pdo(SdoScript& script, std::uint16_t parameters, const BusFrame& frame) {
  const SdoStep cob_id{{parameters, 1}, frame.id, 4, Match::kCobId};
  script.push_back({Kind::kSetting, {cob_id}, {{cob_id.object, frame.id | canopen::kPdoDisabled}, cob_id}});
  const auto map = static_cast<std::uint16_t>(parameters + canopen::kMappingOffset);
  std::vector<SdoStep> entries{{{map, 0}, static_cast<std::uint32_t>(frame.mapped.size()), 1}};
  for (const std::uint32_t entry : frame.mapped)
    entries.push_back({{map, static_cast<std::uint8_t>(entries.size())}, entry});
  script.push_back({Kind::kRequire, std::move(entries), {}});
}

/// Identifier and entries. A PDO may only be mapped while it is off (CiA 301): bit 31 of its COB-ID on, count 0,
/// entries, count, on.
SetupPart pdo(std::uint16_t parameters, const BusFrame& frame) {
  const Object cob_id{parameters, 1}, count{static_cast<std::uint16_t>(parameters + canopen::kMappingOffset), 0};
  const auto mapped = static_cast<std::uint32_t>(frame.mapped.size());
  SetupPart part{
      Kind::kSetting,
      {{cob_id, frame.id, 4, Match::kCobId}, {count, mapped, 1, frame.to_node ? Match::kEqual : Match::kAtLeast}},
      {{cob_id, frame.id | canopen::kPdoDisabled}, {count, 0, 1}}};
  for (std::uint8_t i = 0; i < mapped; ++i) {
    const SdoStep entry{{count.index, static_cast<std::uint8_t>(i + 1)}, frame.mapped[i]};
    part.asked.push_back(entry);
    part.written.push_back(entry);
  }
  part.written.push_back({count, mapped, 1});
  part.written.push_back({cob_id, frame.id});
  return part;
}

/// A PDO that this node is to have none of: on as delivered, it would have an identifier that this file gives to
/// others.
SetupPart pdo_off(Object first, std::size_t pdo, std::uint32_t id) {
  const Object cob_id{static_cast<std::uint16_t>(first.index + pdo), 1};
  const SdoStep off{cob_id, id | canopen::kPdoDisabled, 4, Match::kOff};
  return {Kind::kOptional, {off}, {off}};
}

/// Not faster than SYNC would have it, and so often that what it says does not grow too old in between.
SetupPart own_timer(std::uint16_t parameters, const BusDescription& bus, int nth_sync) {
  constexpr double kInPeriods = 2;  // one until it is read, and the limit counts from the first SYNC
  const double limit_s = bus.sensor_age_limit_s + (nth_sync - kInPeriods) / bus.sync_Hz;
  const auto least = static_cast<std::uint32_t>(std::ceil(1e3 * nth_sync / bus.sync_Hz - 1e-9));
  const auto most = static_cast<std::uint32_t>(std::floor(1e3 * limit_s + 1e-9));
  const SdoStep timer{{parameters, 5}, least << 16 | most, 2, Match::kPeriod};
  return {Kind::kTimer, {timer}, {timer}};
}

/// As its channels say, or its device type (CiA 301: of several devices in one housing).
bool has_several_axes(const NodeDescription& node) noexcept {
  return node.role == NodeRole::kValve && (node.channels.back().number > 1 || node.device_type >> 16 == 0xFFFFU);
}

/// All channels up to the last that is used, as CiA 401 maps them by itself.
std::vector<std::uint32_t> analog_map(Object first, std::uint8_t pdo, std::uint8_t bytes) {
  std::vector<std::uint32_t> mapped;
  for (unsigned number = analog_number(pdo, {.start_bit = 0}); mapped.size() < bytes / sizeof(std::int16_t); ++number)
    mapped.push_back(canopen::mapping({first.index, static_cast<std::uint8_t>(number)}, kAnalogBits));
  return mapped;
}

/// Process data of one node.
std::vector<BusFrame> frames_of(const MachineDescription& machine, const NodeDescription& node) {
  BusDescription alone = machine.bus;
  alone.nodes = {node};
  std::vector<BusFrame> frames = bus_frames(alone, machine.sensors);
  for (const BroadcastFrame& inputs : alone.broadcasts) {
    if (inputs.module == node.id)
      frames.push_back({.pdo = inputs.pdo,
                        .id = inputs.id,
                        .every_nth_sync = 1,
                        .fields = {},
                        .mapped = analog_map(canopen::kAnalogInput, inputs.pdo, inputs.bytes)});
  }
  for (const CommandFrame& outputs : alone.commands) {
    if (outputs.module == node.id)
      frames.push_back({.to_node = true,
                        .pdo = outputs.pdo,
                        .id = outputs.id,
                        .fields = {},
                        .mapped = analog_map(canopen::kAnalogOutput, outputs.pdo, outputs.bytes)});
  }
  return frames;
}

void add_pdos(SdoScript& script, const MachineDescription& machine, const NodeDescription& node) {
  const std::vector<BusFrame> frames = frames_of(machine, node);
  for (const BusFrame& frame : frames) {
    const auto parameters =
        static_cast<std::uint16_t>((frame.to_node ? canopen::kRpdo1CobId : canopen::kTpdo1CobId).index + frame.pdo);
    const bool by_sync = !frame.to_node && frame.every_nth_sync > 0;
    const std::uint32_t type = by_sync ? static_cast<std::uint32_t>(frame.every_nth_sync) : canopen::kEventDriven;
    if (!frame.to_node && !node.tpdo_maps.empty())
      add_fixed_pdo(script, parameters, frame);
    else
      script.push_back(pdo(parameters, frame));
    const bool by_timer = by_sync && (!node.is_told() || node.role == NodeRole::kModule);
    script.push_back(setting({parameters, 2}, type, 1, by_timer ? Kind::kTransmission : Kind::kSetting));
    if (by_timer) script.push_back(own_timer(parameters, machine.bus, frame.every_nth_sync));
    if (frame.repeat_s > 0 && !by_sync && !frame.to_node)
      script.push_back(setting({parameters, 5}, milliseconds(frame.repeat_s), 2));
  }
  const auto has = [&frames](bool to_node, std::size_t pdo) {
    return std::any_of(frames.begin(), frames.end(),
                       [&](const BusFrame& frame) { return frame.to_node == to_node && frame.pdo == pdo; });
  };
  for (std::size_t i = 0; i < NodeDescription::kMostPdos; ++i)
    if (!has(false, i)) script.push_back(pdo_off(canopen::kTpdo1CobId, i, node.tpdo_id(i)));
  // An axis or an output that is not ours moves something, too.
  const bool several = has_several_axes(node) || node.outputs > 0;
  for (std::size_t i = 0; several && i < NodeDescription::kMostPdos; ++i)
    if (!has(true, i)) script.push_back(pdo_off(canopen::kRpdo1CobId, i, node.rpdo_id(i)));
}

/// Nodes that can move something must notice by themselves when the controller is gone.
void add_guards(SdoScript& script, const BusDescription& bus, const NodeDescription& node) {
  const Kind kind = node.unguarded.empty() ? Kind::kGuard : Kind::kOptional;
  // The timers of all its axes are one guard: one alone would leave the others open.
  SetupPart timers{kind, {}, {}};
  for (const std::uint8_t pdo : receive_pdos(node)) {
    const Object timer{static_cast<std::uint16_t>(canopen::kRpdo1Timer.index + pdo), canopen::kRpdo1Timer.subindex};
    timers.asked.push_back({timer, milliseconds(bus.valve_watchdog_s), 2});
  }
  timers.written = timers.asked;
  if (node.role != NodeRole::kEnable) script.push_back(timers);
  const std::uint32_t watched = std::uint32_t{bus.controller_id} << 16 | milliseconds(bus.controller_timeout_s);
  script.push_back(setting(canopen::kConsumerHeartbeat, watched, 4, kind));
  if (node.guard.proved && node.guard.serial != 0)
    script.push_back({Kind::kProof, {{canopen::kSerialNumber, node.guard.serial}}, {}});
}

/// What is counted in steps must not be read in slightly other ones, nor run out of numbers.
void check_step(const MachineDescription& machine, const char* key, double step, double object, double most) {
  constexpr double kSame = 1e-6;
  const auto refuse = [&](const std::string& why) {
    throw InputError(machine.source + ": key 'sensors." + key + "': " + why);
  };
  const double units = step / object;
  if (std::abs(units - std::round(units)) > kSame * units)
    refuse("must be a whole number of the steps its node can be set to");
  if (step * std::numeric_limits<std::int16_t>::max() < most)
    refuse("too fine: its 16 bits would not reach far enough");
}

void require_encoder(SdoScript& script, const MachineDescription& machine, const NodeDescription& node) {
  if (node.measures_angle()) {
    script.push_back(required(canopen::kEncoderStepsPerTurn, node.rotary.steps_per_turn, 4));
    if (node.rotary.turns > 1)  // devices of a single turn may not have it
      script.push_back(required(canopen::kEncoderRange, node.rotary.range(), 4));
    return;
  }
  const double step_m = machine.sensors.encoder_step_m, speed_step_mps = machine.bus.wire.encoder_speed_step_mps;
  check_step(machine, "encoder_step_mm", step_m, 1e-9, 0);
  script.push_back(required(canopen::kEncoderStep, canopen::encoder_step_object(step_m), 4));
  const auto speed_step = static_cast<std::uint32_t>(std::lround(speed_step_mps / 1e-5));  // 0.01 mm/s
  script.push_back(required(canopen::kEncoderSpeedStep, speed_step, 4));
}

/// What no set-up may change: the device, and how it was set to work when it was built in.
SdoScript required_of(const MachineDescription& machine, const NodeDescription& node) {
  SdoScript script{{Kind::kIdentity, {{canopen::kDeviceType, node.device_type}}, {}},
                   {Kind::kIdentity, {{canopen::kVendorId, node.vendor}}, {}},
                   {Kind::kIdentity, {{canopen::kProductCode, node.product}}, {}}};
  const WireDescription& wire = machine.bus.wire;
  for (const NodeChannel& channel : node.channels) {
    const auto of_channel = [&](Object object) { return Object{object.index, channel.number}; };
    if (node.role == NodeRole::kValve)
      script.push_back(required(of_axis(canopen::kValveControlMode, channel.number), 1, 1));
    if (node.role != NodeRole::kPressure) continue;
    script.push_back(required(of_channel(canopen::kPressureUnit), canopen::kUnitBar, 4));
    if (wire.pressure != WireDescription::Pressure::kFloat)
      script.push_back(
          required(of_channel(canopen::kPressureDigits), static_cast<std::uint32_t>(wire.pressure_digits), 1));
  }
  if (node.role == NodeRole::kEncoder) require_encoder(script, machine, node);
  if (node.role == NodeRole::kTilt) {
    const bool on_boom = machine.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom;
    const double most_rad = on_boom ? std::numbers::pi : std::numbers::pi / 3;
    check_step(machine, "tilt_step_deg", machine.sensors.tilt_step_rad, 1e-3 * std::numbers::pi / 180, most_rad);
    script.push_back(required(canopen::kTiltResolution, canopen::tilt_step_object(machine.sensors.tilt_step_rad), 2));
  }
  if (node.outputs > 0) script.push_back(required({canopen::kAnalogOutput.index, 0}, node.outputs, 1));
  return script;
}

/// Of all axes that the device has.
void add_closed_axes(SdoScript& script, const NodeDescription& node) {
  const auto close = [&](unsigned axis, Kind kind) {
    script.push_back(setting(of_axis(canopen::kValveControlWord, axis), valve_words(node.profile).init, 2, kind));
    script.push_back(setting(of_axis(canopen::kValveSetPoint, axis), 0, 2, kind));
  };
  for (const NodeChannel& axis : node.channels) close(axis.number, Kind::kSetting);
  for (unsigned axis = 1; has_several_axes(node) && axis <= NodeDescription::kMostPdos; ++axis) {
    const auto is_ours = [axis](const NodeChannel& channel) { return channel.number == axis; };
    if (std::none_of(node.channels.begin(), node.channels.end(), is_ours)) close(axis, Kind::kOptional);
  }
}

template <typename Add>
void for_outputs(const BusDescription& bus, const NodeDescription& node, const Add& add) {
  for (const CommandFrame& frame : bus.commands) {
    for (const CommandField& field : frame.fields) {
      if (frame.module != node.id) continue;
      add(static_cast<std::uint8_t>(analog_number(frame.pdo, field.bits)),
          static_cast<std::uint32_t>(raw_of(field.bits, field.neutral)));
    }
  }
}

/// What its outputs do when it is left alone, or leaves its operational state: the value before the mode that takes it.
void add_error_values(SdoScript& script, const BusDescription& bus, const NodeDescription& node) {
  for_outputs(bus, node, [&](std::uint8_t number, std::uint32_t neutral) {
    const auto is_signed = static_cast<std::uint32_t>(static_cast<std::int16_t>(neutral));
    script.push_back(setting({canopen::kOutputErrorValue.index, number}, is_signed << node.error_value_shift, 4));
    script.push_back(setting({canopen::kOutputErrorMode.index, number}, 1, 1));
  });
}

/// Raw 0 of an output may be full speed: what it does when it is started, or is left alone, is neutral.
void add_neutral_outputs(SdoScript& script, const BusDescription& bus, const NodeDescription& node) {
  for_outputs(bus, node, [&](std::uint8_t number, std::uint32_t neutral) {
    script.push_back(setting({canopen::kAnalogOutput.index, number}, neutral, 2));
  });
  add_error_values(script, bus, node);
  script.push_back(setting(canopen::kErrorBehaviour, 0, 1, Kind::kOptional));
}

SdoScript node_script(const MachineDescription& machine, const NodeDescription& node) {
  const BusDescription& bus = machine.bus;
  SdoScript script = required_of(machine, node);
  add_pdos(script, machine, node);
  // What it was told before must not become true again when it is started.
  if (node.role == NodeRole::kValve) add_closed_axes(script, node);
  if (node.role == NodeRole::kEnable) script.push_back(setting(canopen::kEnableOutputs, 0, 1));
  if (node.role == NodeRole::kModule) script.push_back(setting(canopen::kAnalogInputSends, 1, 1, Kind::kOptional));
  if (node.outputs > 0) add_neutral_outputs(script, bus, node);
  if (node.is_told()) add_guards(script, bus, node);
  script.push_back(setting(canopen::kProducerHeartbeat, milliseconds(bus.node_heartbeat_s), 2));
  return script;
}

}  // namespace

std::vector<NodeScript> node_scripts(const MachineDescription& machine) {
  std::vector<NodeScript> all;
  for (const NodeDescription& node : machine.bus.nodes) {
    NodeScript& entry = all.emplace_back(NodeScript{node, node_script(machine, node), {}});
    if (node.outputs == 0) continue;
    // A module that runs takes its error values as soon as it is told to rest.
    entry.before_rest = required_of(machine, node);
    add_error_values(entry.before_rest, machine.bus, node);
  }
  return all;
}

SdoScript preset_script(const MachineDescription& machine, int joint, double length_m) {
  const NodeDescription& encoder = machine.bus.encoder(joint);
  const auto reading = EncoderLengths(machine).reading(joint, length_m);
  if (!reading)
    throw InputError(machine.source + fmt::format(": no angle of the {} gives its cylinder a length of {:.1f} mm",
                                                  kJointNames[static_cast<std::size_t>(joint)], 1e3 * length_m));
  const std::vector<FrameField> fields = sent_fields(encoder, machine);
  const FrameField* const value = find_field(fields, FrameField::Part::kValue, encoder.channels.front());
  auto steps = static_cast<std::uint32_t>(raw_of(value->bits, *reading));
  if (encoder.measures_angle()) steps %= encoder.rotary.steps_per_turn;
  return {
      {Kind::kSetting, {}, {{canopen::kEncoderPreset, steps}, {canopen::kStoreParameters, canopen::kSaveSignature}}}};
}

}  // namespace knuckle::slave
