#include "machine/reason_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "machine/pilot_spool.h"
#include "machine/toml_reader.h"
#include "transport/j1939.h"

namespace knuckle {
namespace {

/// The signal that the reason names; null where it names none, or one of a later version.
const SignalInfo* signal_info(const Reason& reason) noexcept {
  const auto place = signal_of(reason);
  return place && *place < kSignals.size() ? &kSignals[*place] : nullptr;
}

/// Of a value that only a broken wire or a short circuit of an analogue sensor can say.
std::string wire_text(const Reason& reason, const BusDescription& bus) {
  const SignalInfo* const signal = signal_info(reason);
  if (signal == nullptr || reason.code != ReasonCode::kSensorInvalid) return "";
  const BroadcastField* const field = bus.broadcast(signal->role, signal->index).field;
  if (field == nullptr || !field->analog || !field->analog->is_broken(double(reason.value))) return "";
  return fmt::format("; outside {}: its wire is broken or has a short circuit",
                     kAnalogRangeNames[static_cast<std::size_t>(field->analog->range)]);
}

/// The frame of the machine's own controller that has the signal that the reason names; null where none has it.
const BroadcastFrame* own_frame(const Reason& reason, const BusDescription& bus) {
  const SignalInfo* const signal = signal_info(reason);
  const BroadcastFrame* const frame = signal != nullptr ? bus.broadcast(signal->role, signal->index).frame : nullptr;
  return frame != nullptr && frame->module == 0 ? frame : nullptr;
}

/// What else may be wrong where pilot pressures say where a spool is.
std::string pilots_text(const Reason& reason, const BusDescription& bus) {
  if (reason.code == ReasonCode::kValveNotFollowing)
    return bus.by_frames() ? "; by its pilot pressures: check their sensors, too" : "";
  if (reason.code != ReasonCode::kSensorImplausible) return "";
  const SignalInfo* const signal = signal_info(reason);
  if (signal != nullptr && signal->role == NodeRole::kPilot)
    return "; or the joint's position sensor is wrong, or its spool sticks";
  for (int joint = 0; joint < kJoints; ++joint) {
    if (tells_pilots(bus, joint) && reason.subject == subject_of(NodeRole::kEncoder, joint, bus))
      return "; or a reading of the joint's pilot pressures is wrong, or its spool sticks";
  }
  return "";
}

}  // namespace

std::uint8_t subject_of(NodeRole role, int index, const BusDescription& bus) noexcept {
  const NodeDescription& node = bus.node_of(role, index);
  if (node.channels.size() == 1) return node.id;
  if (const BroadcastField* const sent = bus.broadcast(role, index).field) return signal_subject(sent->signal);
  const auto is_it = [index](const NodeChannel& channel) { return channel.info().index == index; };
  const auto channel = std::find_if(node.channels.begin(), node.channels.end(), is_it);
  return channel == node.channels.end() ? node.id : signal_subject(channel->signal);
}

const NodeDescription* node_of(const Reason& reason, const BusDescription& bus) noexcept {
  const SubjectKind kind = subject_kind(reason.code);
  if (kind != SubjectKind::kNode && kind != SubjectKind::kNodeOrSignal) return nullptr;
  const SignalInfo* const signal = signal_info(reason);
  if (signal == nullptr) return bus.find(reason.subject);
  const BroadcastFrame* const frame = bus.broadcast(signal->role, signal->index).frame;
  return bus.find(frame != nullptr ? frame->module : bus.node_of(signal->role, signal->index).id);
}

std::string node_text(const NodeDescription& node) {
  return fmt::format("{} (node 0x{:02X})", node.name, node.id);
}

std::string node_text(std::uint8_t id, const BusDescription& bus) {
  const NodeDescription* const node = bus.find(id);
  return node == nullptr ? fmt::format("node 0x{:02X}", id) : node_text(*node);
}

std::string id_text(std::uint32_t id) {
  return (id & kExtendedId) != 0 ? fmt::format("0x{:08X}", id & kMostExtendedId)
                                 : fmt::format("0x{:03X}", id & ~kSecondBus);
}

std::string bus_text(std::uint32_t id, const BusDescription& bus) {
  return bus.second ? ", bus " + bus.line((id & kSecondBus) != 0 ? 1 : 0).name : "";
}

std::string commands_text(const BusDescription& bus) {
  std::string text;
  for (const CommandFrame& frame : bus.commands)
    text += (text.empty() ? "" : ", ") + frame.name + ' ' + id_text(frame.id) + bus_text(frame.id, bus);
  return text;
}

std::string told_channels_text(const NodeDescription& node, const BusDescription& bus) {
  if (node.role != NodeRole::kModule) return channels_text(node);
  std::string text;
  for (const CommandFrame& frame : bus.commands) {
    for (const CommandField& field : frame.fields) {
      if (frame.module != node.id) continue;
      text += fmt::format("{}{}", text.empty() ? "" : ", ", analog_number(frame.pdo, field.bits));
      if (field.joint) text += fmt::format(" = {}", kJointNames[static_cast<std::size_t>(*field.joint)]);
      const auto counts = [&](double value) { return fmt::format("0x{:X}", raw_of(field.bits, value)); };
      text += " (" + counts(field.neutral);
      for (const std::optional<double>& full : {field.extend, field.retract})
        if (field.joint) text += ", " + (full ? counts(*full) : "-");
      text += ')';
    }
  }
  return text + (node.error_value_shift == 0 ? ", in the lower half" : ", in the upper half");
}

std::string frame_text(const BroadcastFrame& frame, const BusDescription& bus) {
  const std::string where = bus_text(frame.id, bus);
  if (!frame.is_group()) return fmt::format("{} ({}{})", frame.name, id_text(frame.id), where);
  const std::string of = frame.source ? fmt::format(" of 0x{:02X}", *frame.source) : "";
  return fmt::format("{} (PGN 0x{:04X}{}{})", frame.name, j1939::group_of(frame.id), of, where);
}

std::string subject_text(const Reason& reason, const BusDescription& bus) {
  const NodeDescription* const node = node_of(reason, bus);
  const SignalInfo* const signal = signal_info(reason);
  if (node == nullptr && signal != nullptr) {
    const BroadcastFrame* const frame = bus.broadcast(signal->role, signal->index).frame;
    return frame == nullptr ? signal->name : frame_text(*frame, bus) + ", " + signal->name;
  }
  if (subject_kind(reason.code) == SubjectKind::kBus && bus.second && reason.subject < bus.lines())
    return "bus " + bus.line(reason.subject).name;
  if (node == nullptr) return subject_text(reason);
  return node_text(*node) + bus_text(node->id, bus) + (signal == nullptr ? "" : std::string(", ") + signal->name);
}

std::string text(const Reason& reason, const BusDescription& bus) {
  if (reason.code == ReasonCode::kFrameShort && own_frame(reason, bus) != nullptr)
    return subject_text(reason, bus) +
           fmt::format(
               ": frame is too short to be used: what sends it was changed, or its bytes in the machine file are wrong "
               "(it has {:.0f}, and {:.0f} in the file)",
               reason.value, reason.limit);
  return text_about(subject_text(reason, bus), reason) + wire_text(reason, bus) + pilots_text(reason, bus);
}

std::string text_with_code(const Reason& reason, const BusDescription& bus) {
  return std::string(name(reason.code)) + ": " + text(reason, bus);
}

}  // namespace knuckle
