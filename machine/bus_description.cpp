#include "machine/bus_description.h"

#include <algorithm>

namespace knuckle {
namespace {

template <typename Is>
const NodeDescription* find_if(const std::vector<NodeDescription>& nodes, const Is& is) noexcept {
  const auto found = std::find_if(nodes.begin(), nodes.end(), is);
  return found == nodes.end() ? nullptr : &*found;
}

/// Id of the module that the signal of this name, or SignalInfo::node, goes through; 0 where it goes through none.
std::uint8_t module_of(const std::string& name, const BusDescription& bus) noexcept {
  for (const SignalInfo& signal : kSignals) {
    if (signal.name != name && signal.node != name) continue;
    const BroadcastFrame* const sent = bus.broadcast(signal.role, signal.index).frame;
    if (sent != nullptr) return sent->module;
    for (const CommandFrame& told : bus.commands)
      if (signal.role == NodeRole::kValve && told.id == bus.set_point_id(signal.index)) return told.module;
  }
  return 0;
}

}  // namespace

bool BroadcastFrame::only_readings() const noexcept {
  return std::all_of(fields.begin(), fields.end(),
                     [](const BroadcastField& field) { return field.info().role == NodeRole::kReading; });
}

double AnalogSensor::broken() const noexcept {
  constexpr std::array kBelow{4.0 / 16, 0.5 / 4, 0.0};  // of the span
  return low - kBelow[static_cast<std::size_t>(range)] * (high - low);
}

bool AnalogSensor::is_broken(double value) const noexcept {
  if (range == Range::k0To10V) return false;
  const bool current = range == Range::k4To20mA;
  const double share = (value - low) / (high - low), below = current ? 0.4 / 16 : 0.25 / 4;
  constexpr double kAbove = 1.0 / 16;  // 1 mA of 16, 0.25 V of 4
  return !(share >= -below && share <= 1 + kAbove);
}

std::optional<double> BroadcastField::value(std::optional<std::uint64_t> raw) const noexcept {
  if (!raw || (invalid_from && *raw >= *invalid_from)) return std::nullopt;
  const double value = value_of(bits, *raw);
  if (analog && analog->is_broken(value)) return std::nullopt;
  return value;
}

bool moves_joint(const CommandFrame& frame) noexcept {
  return std::any_of(frame.fields.begin(), frame.fields.end(),
                     [](const CommandField& field) { return field.joint.has_value(); });
}

int NodeDescription::joint() const noexcept {
  if (role == NodeRole::kTilt || role == NodeRole::kEnable || role == NodeRole::kModule) return -1;
  const auto joint_of = [this](const NodeChannel& channel) {
    return role == NodeRole::kPressure ? channel.info().index / 2 : channel.info().index;
  };
  const auto same = [&](const NodeChannel& channel) { return joint_of(channel) == joint_of(channels.front()); };
  const bool one = !channels.empty() && std::all_of(channels.begin(), channels.end(), same);
  return one ? joint_of(channels.front()) : -1;
}

const NodeDescription& BusDescription::node_of(NodeRole role, int index) const noexcept {
  static const NodeDescription none;
  const NodeDescription* const found = find_if(nodes, [&](const NodeDescription& node) {
    return node.role == role && std::any_of(node.channels.begin(), node.channels.end(),
                                            [&](const NodeChannel& channel) { return channel.info().index == index; });
  });
  return found == nullptr ? none : *found;
}

BusDescription::Broadcast BusDescription::broadcast(NodeRole role, int index) const noexcept {
  for (const BroadcastFrame& frame : broadcasts) {
    for (const BroadcastField& field : frame.fields)
      if (field.info().role == role && field.info().index == index) return {&frame, &field};
  }
  return {};
}

const CommandField* BusDescription::command(int joint, bool extend) const noexcept {
  for (const CommandFrame& frame : commands) {
    for (const CommandField& field : frame.fields)
      if (field.joint == joint && (extend ? field.extend : field.retract)) return &field;
  }
  return nullptr;
}

std::uint32_t BusDescription::command_id(int joint) const noexcept {
  for (const CommandFrame& frame : commands) {
    for (const CommandField& field : frame.fields)
      if (field.joint == joint && field.extend) return frame.id;
  }
  return 0;
}

bool BusDescription::commands_by_address() const noexcept {
  return std::any_of(commands.begin(), commands.end(),
                     [](const CommandFrame& frame) { return frame.mask != CanFilter::kWhole; });
}

std::uint32_t BusDescription::j1939_line() const noexcept {
  for (const CommandFrame& frame : commands)
    if (frame.mask != CanFilter::kWhole) return frame.id & kSecondBus;
  for (const BroadcastFrame& frame : broadcasts)
    if (frame.on_request) return frame.id & kSecondBus;
  return 0;
}

double BusDescription::joint_period_s() const noexcept {
  double longest_s = 0;
  for (const CommandFrame& frame : commands)
    if (moves_joint(frame)) longest_s = std::max(longest_s, frame.period_s);
  return longest_s;
}

double BusDescription::full_rate_radps(int joint, bool extend) const noexcept {
  const CommandField* const field = command(joint, extend);
  if (field == nullptr || command_kind != CommandKind::kJointRate) return 0;
  return std::abs((extend ? field->extend : field->retract).value_or(0) - field->neutral);
}

bool BusDescription::measures_angle(int joint) const noexcept {
  const Broadcast sent = broadcast(NodeRole::kEncoder, joint);
  return sent.field != nullptr ? sent.field->info().is_angle : encoder(joint).measures_angle();
}

NodeChannel BusDescription::valve_channel(int joint) const noexcept {
  for (const NodeChannel& channel : valve(joint).channels)
    if (channel.info().index == joint) return channel;
  return {};
}

bool moves_joint(const BusDescription& bus, std::uint8_t module, int joint) noexcept {
  return std::any_of(bus.commands.begin(), bus.commands.end(), [&](const CommandFrame& frame) {
    return frame.module == module && std::any_of(frame.fields.begin(), frame.fields.end(),
                                                 [&](const CommandField& field) { return field.joint == joint; });
  });
}

bool moves_joints(const BusDescription& bus, std::uint8_t module) noexcept {
  return std::any_of(bus.commands.begin(), bus.commands.end(),
                     [&](const CommandFrame& frame) { return frame.module == module && moves_joint(frame); });
}

std::string channels_text(const NodeDescription& node) {
  std::string all;
  for (const NodeChannel& channel : node.channels)
    all += (all.empty() ? "" : ", ") + std::to_string(channel.number) + " = " + channel.info().name;
  return all;
}

const NodeDescription* BusDescription::find(const std::string& wanted) const noexcept {
  const auto called = [&](const NodeDescription& node) { return node.name == wanted; };
  const auto has = [&](const NodeDescription& node) {
    return std::any_of(node.channels.begin(), node.channels.end(), [&](const NodeChannel& channel) {
      return channel.info().name == wanted || channel.info().node == wanted;
    });
  };
  const NodeDescription* const found = find_if(nodes, called);
  if (found != nullptr) return found;
  if (const NodeDescription* const other = find_if(nodes, has)) return other;
  const std::uint8_t module = module_of(wanted, *this);
  return module == 0 ? nullptr : find(module);
}

const NodeDescription* BusDescription::find(std::uint8_t id) const noexcept {
  return find_if(nodes, [&](const NodeDescription& node) { return node.id == id; });
}

BusDescription BusDescription::alone(std::size_t bus) const {
  BusDescription one = *this;
  const BusLine own = line(bus);
  one.name = own.name;
  one.bit_rate = own.bit_rate;
  one.foreign_load = own.foreign_load;
  one.second.reset();
  if (bus != 0) one.nodes.clear();
  if ((j1939_line() != 0) != (bus != 0)) one.j1939_address.reset();
  const auto keep = [bus](auto& frames) {
    std::erase_if(frames, [bus](const auto& frame) { return ((frame.id & kSecondBus) != 0) != (bus != 0); });
    for (auto& frame : frames) frame.id &= ~kSecondBus;
  };
  keep(one.broadcasts);
  keep(one.commands);
  return one;
}

std::optional<std::size_t> BusDescription::line_named(const std::string& bus) const noexcept {
  for (std::size_t i = 0; i < lines(); ++i)
    if (!bus.empty() && line(i).name == bus) return i;
  return std::nullopt;
}

std::string BusDescription::node_names() const {
  if (nodes.empty()) return "none: no node is on this machine's bus";
  std::string all;
  for (const NodeDescription& node : nodes) all += (all.empty() ? "" : ", ") + node.name;
  return all;
}

}  // namespace knuckle
