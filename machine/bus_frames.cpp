#include "machine/bus_frames.h"

#include <algorithm>
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
  if (wire.pressure == Pressure::kFloat) return {value(canopen::kPressureFloat, Type::kFloat, 32), status};
  if (wire.pressure == Pressure::kInteger16) return {value(canopen::kPressureShort, Type::kSigned, 16), status};
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
      return {field(Part::kStatus, channel, of_axis(canopen::kValveStatusWord, channel.number), Type::kUnsigned, 16),
              field(Part::kValue, channel, of_axis(canopen::kValveActual, channel.number), Type::kSigned, 16)};
    case NodeRole::kPressure:
      return pressure_fields(channel, wire);
    case NodeRole::kEncoder:
      if (channel.info().is_angle) return {angle_field(channel, node.rotary)};
      return {field(Part::kValue, channel, canopen::kEncoderPosition, Type::kSigned, 32, sensors.encoder_step_m),
              field(Part::kRate, channel, canopen::kEncoderSpeed, Type::kSigned, 16, wire.encoder_speed_step_mps)};
    case NodeRole::kTilt:
      return {field(Part::kValue, channel, channel.number == 2 ? canopen::kTiltLateral : canopen::kTiltSlope,
                    Type::kSigned, 16, sensors.tilt_step_rad)};
    case NodeRole::kEnable:
    case NodeRole::kReading:
    case NodeRole::kPilot:
    case NodeRole::kModule:
      break;
  }
  return {field(Part::kStatus, channel, canopen::kEnableInputs, Type::kUnsigned, 8)};
}

std::vector<FrameField> told(const NodeDescription& node, const NodeChannel& channel) {
  if (node.role != NodeRole::kValve)
    return {field(Part::kControl, channel, canopen::kEnableOutputs, Type::kUnsigned, 8)};
  return {field(Part::kControl, channel, of_axis(canopen::kValveControlWord, channel.number), Type::kUnsigned, 16),
          field(Part::kValue, channel, of_axis(canopen::kValveSetPoint, channel.number), Type::kSigned, 16)};
}

int bits_of(const std::vector<FrameField>& fields) noexcept {
  int bits = 0;
  for (const FrameField& one : fields) bits += one.bits.bits;
  return bits;
}

std::uint32_t mapping(const FrameField& field) noexcept {
  return canopen::mapping(field.object, field.bits.bits);
}

BusFrame pdo(std::size_t number, std::vector<std::uint32_t> mapped = {}) {
  return {.pdo = static_cast<std::uint8_t>(number), .fields = {}, .mapped = std::move(mapped)};
}

void map_next(BusFrame& frame, std::vector<FrameField> group) {
  for (FrameField& one : group) {
    one.bits.start_bit = static_cast<std::uint8_t>(bits_of(frame.fields));
    frame.mapped.push_back(mapping(one));
    frame.fields.push_back(std::move(one));
  }
}

/// As the device maps it, whatever else that is. What belongs to a value in another frame is not known.
std::vector<BusFrame> packed_by_device(const NodeDescription& node, const std::vector<FrameField>& wanted) {
  std::vector<BusFrame> frames;
  for (const std::vector<std::uint32_t>& map : node.tpdo_maps) {
    BusFrame& frame = frames.emplace_back(pdo(frames.size(), map));
    std::uint32_t at = 0;
    for (const std::uint32_t entry : map) {
      for (const FrameField& one : wanted) {
        if (mapping(one) != entry) continue;
        frame.fields.push_back(one);
        frame.fields.back().bits.start_bit = static_cast<std::uint8_t>(at);
      }
      at += canopen::mapped_bits(entry);
    }
    const std::vector<FrameField> found = frame.fields;
    std::erase_if(frame.fields,
                  [&](const FrameField& one) { return find_field(found, Part::kValue, one.channel) == nullptr; });
  }
  return frames;
}

/// What the transmit PDOs map, and what of it is known. One after another; a group that a frame has no room for begins
/// the next. An axis of a valve has its own.
std::vector<BusFrame> packed(const NodeDescription& node, const WireDescription& wire,
                             const SensorDescription& sensors) {
  constexpr int kMostBits = 64;
  std::vector<BusFrame> frames;
  std::vector<FrameField> all;
  for (const NodeChannel& channel : node.channels) {
    std::vector<FrameField> group = sent(node, channel, wire, sensors);
    all.insert(all.end(), group.begin(), group.end());
    if (node.role == NodeRole::kValve)
      frames.push_back(pdo(channel.pdo()));
    else if (frames.empty() || bits_of(frames.back().fields) + bits_of(group) > kMostBits)
      frames.push_back(pdo(frames.size()));
    map_next(frames.back(), std::move(group));
  }
  return node.tpdo_maps.empty() ? frames : packed_by_device(node, all);
}

int nth_sync(const BusDescription& bus, NodeRole role) noexcept {
  if (role == NodeRole::kValve) return bus.valve_status_every_nth_sync;
  if (role == NodeRole::kTilt) return bus.tilt_every_nth_sync;
  return role == NodeRole::kEnable ? 0 : 1;
}

}  // namespace

std::uint8_t BusFrame::bytes() const noexcept {
  std::uint32_t bits = 0;
  for (const std::uint32_t entry : mapped) bits += canopen::mapped_bits(entry);
  return static_cast<std::uint8_t>(bits / 8);
}

std::vector<std::uint8_t> transmit_pdos(const NodeDescription& node, const WireDescription& wire) {
  std::vector<std::uint8_t> pdos;
  for (const BusFrame& frame : packed(node, wire, {})) pdos.push_back(frame.pdo);
  return pdos;
}

std::vector<std::uint8_t> receive_pdos(const NodeDescription& node) {
  std::vector<std::uint8_t> pdos;
  for (const NodeChannel& channel : node.channels)
    if (node.is_told()) pdos.push_back(channel.pdo());
  for (unsigned output = 1; output <= node.outputs; output += kAnalogsPerFrame) pdos.push_back(analog_pdo(output));
  return pdos;
}

const FrameField* find_field(const std::vector<FrameField>& fields, FrameField::Part part,
                             const NodeChannel& channel) noexcept {
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const FrameField& field) {
    return field.part == part && field.channel == channel;
  });
  return found == fields.end() ? nullptr : &*found;
}

std::vector<FrameField> sent_fields(const NodeDescription& node, const WireDescription& wire,
                                    const SensorDescription& sensors) {
  std::vector<FrameField> all;
  for (const BusFrame& frame : packed(node, wire, sensors))
    all.insert(all.end(), frame.fields.begin(), frame.fields.end());
  return all;
}

bool lacks_status(const std::vector<FrameField>& fields, const NodeChannel& channel) noexcept {
  return channel.info().role == NodeRole::kPressure &&
         find_field(fields, FrameField::Part::kStatus, channel) == nullptr;
}

std::string missing_status_text(const NodeDescription& node, const MachineDescription& machine) {
  const std::vector<FrameField> fields = sent_fields(node, machine);
  std::string names;
  for (const NodeChannel& channel : node.channels)
    if (lacks_status(fields, channel)) names += (names.empty() ? "" : ", ") + std::string(channel.info().name);
  if (names.empty()) return "";
  return "sends " + names +
         " without status (0x6150): a broken transmitter is found only where the value leaves its range or "
         "contradicts the others";
}

std::vector<BusFrame> bus_frames(const BusDescription& bus, const SensorDescription& sensors) {
  std::vector<BusFrame> frames;
  for (std::size_t n = 0; n < bus.nodes.size(); ++n) {
    const NodeDescription& node = bus.nodes[n];
    for (BusFrame& frame : packed(node, bus.wire, sensors)) {
      frame.node = n;
      frame.id = node.tpdo_id(frame.pdo);
      frame.every_nth_sync = nth_sync(bus, node.role);
      frame.repeat_s = bus.controller_heartbeat_s;
      frames.push_back(std::move(frame));
    }
    for (const NodeChannel& channel : node.channels) {
      if (!node.is_told()) continue;
      BusFrame& frame = frames.emplace_back(pdo(channel.pdo()));
      map_next(frame, told(node, channel));
      frame.node = n;
      frame.to_node = true;
      frame.id = node.rpdo_id(frame.pdo);
      frame.every_nth_sync = node.role == NodeRole::kValve ? bus.set_point_every_nth_sync : bus.kEnableEveryNthSync;
    }
  }
  return frames;
}

}  // namespace knuckle
