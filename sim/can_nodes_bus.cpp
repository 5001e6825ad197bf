// All nodes behind one port: who hears what, in which order they step, and what was injected.
#include <algorithm>
#include <numbers>

#include "machine/description.h"
#include "sim/can_nodes.h"
#include "transport/j1939.h"

namespace knuckle::sim {

namespace {

/// Engine at 1800 rpm and running, oil and coolant in degC, hours in s, battery in V, share of the tank.
constexpr std::array kReadings{60 * std::numbers::pi, 1.0, 48.0, 84.0, 4321 * 3600.0, 27.6, 0.62};
constexpr double kPilotNoise_Pa = 0.1e5;
constexpr std::uint8_t kAddress = 0x00;  // of a group's sender where the file gives none

/// A group is sent from one address.
std::uint32_t sent_as(const BroadcastFrame& frame) noexcept {
  if (!frame.is_group()) return frame.id;
  return (frame.id & ~0xFFU) | frame.source.value_or(kAddress);
}

SensorNode encoder_node(const MachineDescription& machine, std::size_t joint) {
  const NodeDescription& node = machine.bus.encoder(joint);
  if (node.measures_angle()) return {SensorNode::Kind::kRotary, node, 0, 0};
  return {SensorNode::Kind::kEncoder, node, machine.sensors.encoder_step_m, machine.cylinders[joint].max_length_m,
          machine.bus.wire};
}

}  // namespace

CanNodes::CanNodes(const MachineDescription& machine, const SensorErrors& errors, CanBus& port, std::uint64_t seed)
    : port_(port),
      errors_(errors),
      random_(seed),
      enable_(machine.bus),
      broadcasts_(machine.bus.broadcasts),
      broadcast_faults_(broadcasts_) {
  for (const NodeDescription& node : machine.bus.nodes) {
    if (node.role == NodeRole::kValve) {
      valves_.emplace_back(node, machine.bus.wire.valve_full_stroke);
      valve_channels_.push_back(node.channels);
    }
    if (node.role != NodeRole::kPressure) continue;
    pressures_.emplace_back(SensorNode::Kind::kPressure, node, machine.sensors.pressure_step_Pa,
                            machine.sensors.pressure_range_Pa, machine.bus.wire, node.channels.back().number);
    pressure_channels_.push_back(node.channels);
  }
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    if (machine.bus.encoder(joint).channels.empty()) continue;
    encoders_.push_back(encoder_node(machine, joint));
    encoder_signals_.push_back(machine.bus.encoder(joint).channels.front());
  }
  if (const NodeDescription& tilt = machine.bus.tilt(); !tilt.channels.empty()) {
    tilts_.emplace_back(SensorNode::Kind::kTilt, tilt, machine.sensors.tilt_step_rad, std::numbers::pi);
    tilt_signal_ = tilt.channels.front();
  }
  for (ValveNode& node : valves_) all_.push_back(&node.protocol());
  first_pressure_ = all_.size();
  for (SensorNode& node : pressures_) all_.push_back(&node.protocol());
  first_encoder_ = all_.size();
  for (SensorNode& node : encoders_) all_.push_back(&node.protocol());
  first_tilt_ = all_.size();
  for (SensorNode& node : tilts_) all_.push_back(&node.protocol());
  enable_at_ = all_.size();
  all_.push_back(&enable_.protocol());
  for (const NodeDescription& node : machine.bus.nodes)
    if (node.role == NodeRole::kModule) modules_.emplace_back(node, machine.bus);
  for (ModuleNode& node : modules_) all_.push_back(&node.protocol());
  silent_.assign(all_.size(), 0);
  if (machine.bus.by_frames()) own_.emplace(machine);
  if (!machine.bus.has_enable()) silent_[enable_at_] = 1;
  for (const BroadcastFrame& frame : broadcasts_)
    broadcast_due_.push_back(frame.on_request || frame.module != 0 ? Time::max() : Time{});
  broadcast_count_.assign(broadcasts_.size(), 0);
  for (const BroadcastFrame& frame : broadcasts_)
    packets_of_.push_back(j1939::in_packets(frame.bytes) ? packets_.add(sent_as(frame), frame.bytes) : 0);
}

void CanNodes::step(Time now, const MachineSignals& signals) noexcept {
  now_ = now;
  spool_ = signals.spool;
  out_.count = 0;
  hear(now);
  for (std::size_t i = 0; i < valves_.size(); ++i) step_node(i, valves_[i], spools_of(i));
  step_sensors(signals);
  step_node(enable_at_, enable_);
  step_modules(signals);
  const bool supplied = enable_.protocol().id() == 0 || enable_.pilot();
  if (own_) own_->step(now, {signals.shaft_rad, signals.cylinder_mps, signals.lever_m, signals.pressure_Pa}, supplied);
  step_broadcasts(signals);
  for (std::size_t i = 0; i < out_.count; ++i) {
    // The enable node hears its neighbours over the bus, the first, which carries nothing while it is down.
    const bool carried = port_.send(out_.frames[i]) && (port_.state() == CanState::kActive || port_.state_of() != 0);
    if (carried && !silent_[enable_at_]) enable_.observe(out_.frames[i]);
  }
}

template <typename Node, typename... Arguments>
void CanNodes::step_node(std::size_t index, Node& node, const Arguments&... arguments) noexcept {
  const std::size_t before = out_.count;
  node.step(now_, arguments..., out_);
  if (silent_[index]) out_.count = before;
}

void CanNodes::hear(Time now) noexcept {
  CanFrame frame;
  while (port_.receive(frame)) {
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (!silent_[i]) all_[i]->receive(frame, now, out_);
    }
    if (!silent_[enable_at_]) enable_.observe(frame);
    if (own_) own_->hear(frame, now);
    hear_request(frame, now);
  }
}

void CanNodes::hear_request(const CanFrame& frame, Time now) noexcept {
  CanFrame alone = frame;
  alone.id &= ~kSecondBus;
  const auto group = j1939::requested(alone);
  for (std::size_t i = 0; group && i < broadcasts_.size(); ++i) {
    const std::uint32_t id = sent_as(broadcasts_[i]);
    if ((id & kSecondBus) != (frame.id & kSecondBus)) continue;
    // Who is asked alone for what needs several packets opens a connection to whoever asks, which nobody here takes.
    if (j1939::in_packets(broadcasts_[i].bytes) && (frame.id >> 8 & 0xFFU) != j1939::kEverybody) continue;
    if (broadcasts_[i].is_group() && j1939::group_of(id) == *group && j1939::is_for(j1939::source_of(id), frame.id))
      broadcast_due_[i] = now;
  }
}

void CanNodes::measured(const PerJoint<ValveRoughness>& valves) noexcept {
  if (own_) own_->measured(valves);
}

void CanNodes::set_estop(bool pressed) noexcept {
  estop_ = pressed;
  enable_.set_estop(pressed);
  if (own_) own_->set_estop(pressed);
}

/// With the sensor's errors but its noise; of a length or an angle likewise.
double CanNodes::sensed(const SignalInfo& signal, const MachineSignals& signals) const noexcept {
  const auto chamber = static_cast<std::size_t>(signal.index);
  switch (signal.role) {
    case NodeRole::kPressure:
      return errors_.pressure_gain[chamber] * signals.pressure_Pa[chamber] + errors_.pressure_offset_Pa[chamber];
    case NodeRole::kEncoder:
      if (signal.is_angle)
        return signals.shaft_rad[signal.index] + errors_.encoder_offset_m[signal.index] / errors_.rotary_lever_m;
      return signals.cylinder_m[signal.index] + errors_.encoder_offset_m[signal.index];
    case NodeRole::kTilt:
      return signals.slope_rad + errors_.tilt_offset_rad;
    case NodeRole::kReading:
      return kReadings[static_cast<std::size_t>(signal.index)];
    case NodeRole::kPilot:
      return own_ ? own_->pilots().pressure_Pa(signal.index) : 0;
    case NodeRole::kValve:
    case NodeRole::kEnable:
    case NodeRole::kModule:
      break;
  }
  return 0;
}

std::uint64_t CanNodes::raw_status(const BroadcastField& field) const noexcept {
  const bool pilot = own_ ? own_->pilot() : enable_.pilot();
  const bool engine = field.info().role == NodeRole::kReading;
  const bool yes = engine || (field.info().index == kPilotOnIndex ? pilot : !estop_);
  const std::uint64_t no = field.on == 0 ? 1 : 0;
  return yes ? field.on : no;
}

double CanNodes::noise_of(const SignalInfo& signal) noexcept {
  if (signal.role == NodeRole::kPressure)
    return noise(errors_.pressure_noise_Pa[static_cast<std::size_t>(signal.index)]);
  if (signal.role == NodeRole::kTilt) return noise(errors_.tilt_noise_rad);
  if (signal.role == NodeRole::kPilot) return noise(kPilotNoise_Pa);
  if (signal.role == NodeRole::kReading) return 0;
  return noise(errors_.encoder_noise_m) / (signal.is_angle ? errors_.rotary_lever_m : 1);
}

void CanNodes::step_sensors(const MachineSignals& signals) noexcept {
  for (std::size_t i = 0; i < pressures_.size(); ++i) {
    const std::vector<NodeChannel>& channels = pressure_channels_[i];
    std::array<SensorNode::Sample, SensorNode::kMostChannels> samples;
    const bool samples_now = pressures_[i].protocol().samples_now();
    for (std::size_t c = 0; samples_now && c < channels.size(); ++c)
      samples[channels[c].number - 1U].value = sensed(channels[c].info(), signals) + noise_of(channels[c].info());
    step_node(first_pressure_ + i, pressures_[i],
              std::span<const SensorNode::Sample>(samples.data(), channels.back().number));
  }
  for (std::size_t i = 0; i < encoders_.size(); ++i) {
    const SignalInfo& signal = encoder_signals_[i].info();
    SensorNode::Sample sample{sensed(signal, signals), signals.cylinder_mps[signal.index]};
    if (encoders_[i].protocol().samples_now()) sample.value += noise_of(signal);
    step_node(first_encoder_ + i, encoders_[i], sample);
  }
  for (std::size_t i = 0; i < tilts_.size(); ++i) {
    SensorNode::Sample slope;
    if (tilts_[i].protocol().samples_now())
      slope.value = sensed(tilt_signal_.info(), signals) + noise_of(tilt_signal_.info());
    step_node(first_tilt_ + i, tilts_[i], slope);
  }
}

/// Pilot valves hang on the outputs, whoever is on the bus.
void CanNodes::step_modules(const MachineSignals& signals) noexcept {
  for (std::size_t i = 0; i < modules_.size(); ++i) {
    ModuleNode& module = modules_[i];
    if (module.protocol().samples_now()) {
      for (const BroadcastFrame& frame : module.inputs()) {
        for (const BroadcastField& field : frame.fields)
          module.sense(frame, field, sensed(field.info(), signals) + noise_of(field.info()));
      }
    }
    step_node(enable_at_ + 1 + i, module);
    for (std::size_t k = 0; k < module.output_frames(); ++k) own_->hear(module.output_frame(k), now_, false);
  }
}

void CanNodes::write(const BroadcastField& field, const MachineSignals& signals, CanFrame& frame) noexcept {
  if (is_yes_or_no(field.info())) return write_raw(field.bits, raw_status(field), frame);
  const std::uint64_t raw = raw_of(field.bits, sensed(field.info(), signals) + noise_of(field.info()));
  write_raw(field.bits, field.invalid_from ? std::min(raw, *field.invalid_from - 1) : raw, frame);
}

/// What is in no field is "not available".
void CanNodes::send_in_packets(std::size_t broadcast, const MachineSignals& signals) noexcept {
  auto& message = packets_.message(packets_of_[broadcast]);
  message.fill(0xFF);
  for (const BroadcastField& field : broadcasts_[broadcast].fields) {
    CanFrame part{.size = 8, .data = {}};
    const std::size_t bytes = std::min(part.data.size(), message.size() - field.first_byte);
    auto* const from = message.begin() + field.first_byte;
    std::copy_n(from, bytes, part.data.begin());
    write(field, signals, part);
    std::copy_n(part.data.begin(), bytes, from);
  }
  packets_.send(packets_of_[broadcast]);
}

/// The machine's own controller sends by its own clock, whatever state the nodes are in.
void CanNodes::step_broadcasts(const MachineSignals& signals) noexcept {
  for (std::size_t i = 0; i < broadcasts_.size(); ++i) {
    const BroadcastFrame& sent = broadcasts_[i];
    if (now_ < broadcast_due_[i]) continue;
    broadcast_due_[i] = sent.on_request ? Time::max() : now_ + from_seconds(sent.period_s);
    if (j1939::in_packets(sent.bytes)) {
      send_in_packets(i, signals);
      continue;
    }
    CanFrame frame{.id = sent_as(sent), .size = sent.bytes, .data = {}};
    if (sent.multiplexer) write_raw(sent.multiplexer->bits, sent.multiplexer->value, frame);
    for (const BroadcastField& field : sent.fields) write(field, signals, frame);
    broadcast_faults_.spoil_values(i, sent, frame);
    // The counter runs over all frames of an identifier.
    const auto first = std::find_if(broadcasts_.begin(), broadcasts_.end(),
                                    [&](const BroadcastFrame& other) { return sent_as(other) == frame.id; });
    std::uint64_t& count = broadcast_count_[static_cast<std::size_t>(first - broadcasts_.begin())];
    close_frame(sent.closing, count, frame);
    if (sent.closing.counter) count = next_count(*sent.closing.counter, count);
    if (broadcast_faults_.spoil(i, sent, frame)) out_.push(frame);
  }
  packets_.step(now_, out_);
}

ValveNode::Spools CanNodes::spools_of(std::size_t valve) const noexcept {
  ValveNode::Spools spools{};
  for (const NodeChannel& axis : valve_channels_[valve]) spools[axis.number - 1U] = spool_[axis.info().index];
  return spools;
}

NodeOutputs CanNodes::outputs() const noexcept {
  if (own_) {
    const bool has_enable = enable_.protocol().id() != 0;
    return {own_->spool_demand(), own_->pilot() && (!has_enable || enable_.pilot())};
  }
  NodeOutputs out{.pilot = enable_.pilot()};
  for (std::size_t i = 0; i < valves_.size(); ++i)
    for (const NodeChannel& axis : valve_channels_[i])
      out.spool_demand[axis.info().index] = valves_[i].demand(axis.number - 1U);
  return out;
}

std::size_t CanNodes::index_of(std::uint8_t id) const noexcept {
  if (id == 0) return all_.size();  // of no node
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (all_[i]->id() == id) return i;
  }
  return all_.size();
}

bool CanNodes::inject(std::uint8_t id, NodeFault fault) noexcept {
  const std::size_t i = index_of(id);
  if (i == all_.size()) return false;
  const bool valve = i < first_pressure_;
  const bool encoder = i >= first_encoder_ && i < first_tilt_;
  if ((fault == NodeFault::kStuck && !valve) || (fault == NodeFault::kBrokenWire && !encoder)) return false;
  if (fault == NodeFault::kSpike && (valve || i == enable_at_)) return false;
  if (i > enable_at_) {
    const bool known = modules_[i - enable_at_ - 1].inject(fault);
    if (known) silent_[i] = fault == NodeFault::kSilent;
    return known;
  }
  const bool guard = fault == NodeFault::kDeadGuard;
  if (guard && !valve && i != enable_at_) return false;
  const bool own = fault == NodeFault::kNone || fault == NodeFault::kSilent || guard;
  if (i == enable_at_ && !own) return false;
  silent_[i] = fault == NodeFault::kSilent;
  if (valve) {
    valves_[i].inject(fault, spools_of(i));
  } else if (i < first_encoder_) {
    pressures_[i - first_pressure_].inject(fault, now_);
  } else if (encoder) {
    encoders_[i - first_encoder_].inject(fault, now_);
  } else if (i < enable_at_) {
    tilts_[i - first_tilt_].inject(fault, now_);
  } else {
    enable_.inject(fault);
  }
  return true;
}

bool CanNodes::inject_pilot(int joint, bool extend, PilotFault fault) noexcept {
  if (own_) own_->pilots().inject(joint, extend, fault);
  return own_.has_value();
}

bool CanNodes::send_emcy(std::uint8_t id, std::uint16_t code) noexcept {
  const std::size_t i = index_of(id);
  if (i == all_.size() || silent_[i]) return false;
  return port_.send(canopen::emergency_frame(id, {code, static_cast<std::uint8_t>(code == 0 ? 0 : 1), {}}));
}

bool CanNodes::set_product(std::uint8_t id, std::uint32_t product) noexcept {
  NodeProtocol* protocol = node(id);
  if (protocol != nullptr) protocol->replace(canopen::kProductCode, product);
  return protocol != nullptr;
}

NodeProtocol* CanNodes::node(std::uint8_t id) noexcept {
  const std::size_t i = index_of(id);
  return i == all_.size() ? nullptr : all_[i];
}

}  // namespace knuckle::sim
