#include "machine/bus_frames.h"

#include <utility>

namespace knuckle {
namespace {

using Part = FrameField::Part;
using Type = BitField::Type;

canopen::Object of_channel(canopen::Object object, const NodeChannel& channel) noexcept {
  return {object.index, channel.number};
}

FrameField field(Part part, const NodeChannel& channel, canopen::Object object, Type type, std::uint8_t bits,
                 double scale = 1) {
  return {part, channel, object, {.type = type, .bits = bits, .scale = scale}};
}

/// What belongs together: a channel's value and what tells whether it is one.
std::vector<FrameField> pressure_fields(const NodeChannel& channel, const WireDescription& wire) {
  using Pressure = WireDescription::Pressure;
  const double unit_Pa = wire.pressure_unit_Pa();
  const auto value = [&](canopen::Object object, Type type, std::uint8_t bits) {
    return field(Part::kValue, channel, of_channel(object, channel), type, bits, unit_Pa);
  };
  const FrameField status =
      field(Part::kStatus, channel, of_channel(canopen::kPressureStatus, channel), Type::kUnsigned, 8);
  switch (wire.pressure) {
    case Pressure::kInteger:
      break;
    case Pressure::kFloat:
      return {value(canopen::kPressureFloat, Type::kFloat, 32), status};
    case Pressure::kInteger16:
      return {value(canopen::kPressureShort, Type::kSigned, 16), status};
  }
  return {value(canopen::kPressureValue, Type::kSigned, 32), status};
}

FrameField angle_field(const NodeChannel& channel, const RotaryDescription& rotary) {
  FrameField angle =
      field(Part::kValue, channel, canopen::kEncoderPosition, Type::kUnsigned, 32, rotary.sign * rotary.step_rad());
  angle.bits.offset = rotary.zero_rad;
  return angle;
}

std::vector<FrameField> sent(const NodeDescription& node, const NodeChannel& channel, const WireDescription& wire,
                             const SensorDescription& sensors) {
  switch (node.role) {
    case NodeRole::kValve:
      return {field(Part::kStatus, channel, canopen::kValveStatusWord, Type::kUnsigned, 16),
              field(Part::kValue, channel, canopen::kValveActual, Type::kSigned, 16)};
    case NodeRole::kPressure:
      return pressure_fields(channel, wire);
    case NodeRole::kEncoder:
      if (channel.info().is_angle) return {angle_field(channel, node.rotary)};
      return {field(Part::kValue, channel, canopen::kEncoderPosition, Type::kSigned, 32, sensors.encoder_step_m),
              field(Part::kRate, channel, canopen::kEncoderSpeed, Type::kSigned, 16, wire.encoder_speed_step_mps)};
    case NodeRole::kTilt:
      return {field(Part::kValue, channel, canopen::kTiltSlope, Type::kSigned, 16, sensors.tilt_step_rad)};
    case NodeRole::kEnable:
      break;
  }
  return {field(Part::kStatus, channel, canopen::kEnableInputs, Type::kUnsigned, 8)};
}

std::vector<FrameField> told(const NodeDescription& node) {
  const NodeChannel channel = node.channels.front();
  if (node.role == NodeRole::kValve)
    return {field(Part::kControl, channel, canopen::kValveControlWord, Type::kUnsigned, 16),
            field(Part::kValue, channel, canopen::kValveSetPoint, Type::kSigned, 16)};
  if (node.role == NodeRole::kEnable)
    return {field(Part::kControl, channel, canopen::kEnableOutputs, Type::kUnsigned, 8)};
  return {};
}

int bits_of(const std::vector<FrameField>& fields) noexcept {
  int bits = 0;
  for (const FrameField& one : fields) bits += one.bits.bits;
  return bits;
}

/// One after another; a group that a frame has no room for begins the next.
std::vector<std::vector<FrameField>> packed(const NodeDescription& node, const WireDescription& wire,
                                            const SensorDescription& sensors) {
  constexpr int kMostBits = 64;
  std::vector<std::vector<FrameField>> frames;
  for (const NodeChannel& channel : node.channels) {
    std::vector<FrameField> group = sent(node, channel, wire, sensors);
    if (frames.empty() || bits_of(frames.back()) + bits_of(group) > kMostBits) frames.emplace_back();
    for (FrameField& one : group) {
      one.bits.start_bit = static_cast<std::uint8_t>(bits_of(frames.back()));
      frames.back().push_back(std::move(one));
    }
  }
  return frames;
}

int nth_sync(const BusDescription& bus, NodeRole role) noexcept {
  if (role == NodeRole::kValve) return bus.valve_status_every_nth_sync;
  if (role == NodeRole::kTilt) return bus.tilt_every_nth_sync;
  return role == NodeRole::kEnable ? 0 : 1;
}

}  // namespace

std::uint8_t BusFrame::bytes() const noexcept {
  return static_cast<std::uint8_t>(bits_of(fields) / 8);
}

std::size_t transmit_pdos(const NodeDescription& node, const WireDescription& wire) {
  return packed(node, wire, {}).size();
}

bool sends(const NodeDescription& node, std::uint32_t id, const WireDescription& wire) {
  for (std::size_t pdo = 0; pdo < transmit_pdos(node, wire); ++pdo) {
    if (node.tpdo_id(pdo) == id) return true;
  }
  return false;
}

std::vector<FrameField> sent_fields(const NodeDescription& node, const MachineDescription& machine) {
  std::vector<FrameField> all;
  for (const std::vector<FrameField>& fields : packed(node, machine.bus.wire, machine.sensors))
    all.insert(all.end(), fields.begin(), fields.end());
  return all;
}

std::vector<BusFrame> bus_frames(const BusDescription& bus, const SensorDescription& sensors) {
  std::vector<BusFrame> frames;
  for (std::size_t n = 0; n < bus.nodes.size(); ++n) {
    const NodeDescription& node = bus.nodes[n];
    std::uint8_t pdo = 0;
    for (std::vector<FrameField>& fields : packed(node, bus.wire, sensors)) {
      frames.push_back(
          {n, false, pdo, node.tpdo_id(pdo), nth_sync(bus, node.role), bus.controller_heartbeat_s, std::move(fields)});
      ++pdo;
    }
    std::vector<FrameField> fields = told(node);
    if (fields.empty()) continue;
    fields.back().bits.start_bit = static_cast<std::uint8_t>(bits_of(fields) - fields.back().bits.bits);
    const bool valve = node.role == NodeRole::kValve;
    frames.push_back({n, true, 0, node.rpdo_id(), valve ? bus.set_point_every_nth_sync : bus.kEnableEveryNthSync, 0,
                      std::move(fields)});
  }
  return frames;
}

}  // namespace knuckle
