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

/// What one PDO maps, and what of it is known.
struct Pdo {
  std::uint8_t number = 0;  ///< From 0.
  std::vector<FrameField> fields;
  std::vector<std::uint32_t> mapped;
  void add(std::vector<FrameField> group) {
    for (FrameField& one : group) {
      one.bits.start_bit = static_cast<std::uint8_t>(bits_of(fields));
      mapped.push_back(mapping(one));
      fields.push_back(std::move(one));
    }
  }
};

/// As the device maps it, whatever else that is. What belongs to a value in another frame is not known.
std::vector<Pdo> packed_by_device(const NodeDescription& node, const std::vector<FrameField>& wanted) {
  std::vector<Pdo> frames;
  for (const std::vector<std::uint32_t>& map : node.tpdo_maps) {
    Pdo pdo{static_cast<std::uint8_t>(frames.size()), {}, map};
    std::uint32_t at = 0;
    for (const std::uint32_t entry : map) {
      for (const FrameField& one : wanted) {
        if (mapping(one) != entry) continue;
        pdo.fields.push_back(one);
        pdo.fields.back().bits.start_bit = static_cast<std::uint8_t>(at);
      }
      at += canopen::mapped_bits(entry);
    }
    const std::vector<FrameField> found = pdo.fields;
    std::erase_if(pdo.fields,
                  [&](const FrameField& one) { return find_field(found, Part::kValue, one.channel) == nullptr; });
    frames.push_back(std::move(pdo));
  }
  return frames;
}

/// One after another; a group that a frame has no room for begins the next. An axis of a valve has its own.
std::vector<Pdo> packed(const NodeDescription& node, const WireDescription& wire, const SensorDescription& sensors) {
  constexpr int kMostBits = 64;
  std::vector<Pdo> frames;
  std::vector<FrameField> all;
  for (const NodeChannel& channel : node.channels) {
    std::vector<FrameField> group = sent(node, channel, wire, sensors);
    all.insert(all.end(), group.begin(), group.end());
    if (node.role == NodeRole::kValve)
      frames.push_back({channel.pdo(), {}, {}});
    else if (frames.empty() || bits_of(frames.back().fields) + bits_of(group) > kMostBits)
      frames.push_back({static_cast<std::uint8_t>(frames.size()), {}, {}});
    frames.back().add(std::move(group));
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
  for (const Pdo& pdo : packed(node, wire, {})) pdos.push_back(pdo.number);
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

std::vector<FrameField> sent_fields(const NodeDescription& node, const MachineDescription& machine) {
  std::vector<FrameField> all;
  for (const Pdo& pdo : packed(node, machine.bus.wire, machine.sensors))
    all.insert(all.end(), pdo.fields.begin(), pdo.fields.end());
  return all;
}

std::vector<BusFrame> bus_frames(const BusDescription& bus, const SensorDescription& sensors) {
  std::vector<BusFrame> frames;
  for (std::size_t n = 0; n < bus.nodes.size(); ++n) {
    const NodeDescription& node = bus.nodes[n];
    for (Pdo& pdo : packed(node, bus.wire, sensors))
      frames.push_back({n, false, pdo.number, node.tpdo_id(pdo.number), nth_sync(bus, node.role),
                        bus.controller_heartbeat_s, std::move(pdo.fields), std::move(pdo.mapped)});
    const bool valve = node.role == NodeRole::kValve;
    for (const NodeChannel& channel : node.channels) {
      if (!node.is_told()) continue;
      Pdo pdo{channel.pdo(), {}, {}};
      pdo.add(told(node, channel));
      frames.push_back({n, true, pdo.number, node.rpdo_id(pdo.number),
                        valve ? bus.set_point_every_nth_sync : bus.kEnableEveryNthSync, 0, std::move(pdo.fields),
                        std::move(pdo.mapped)});
    }
  }
  return frames;
}

}  // namespace knuckle
