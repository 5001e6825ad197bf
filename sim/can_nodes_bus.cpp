// All nodes behind one port: who hears what, in which order they step, and what was injected.
#include "machine/description.h"
#include "sim/can_nodes.h"

namespace knuckle::sim {

namespace {

constexpr std::size_t kFirstPressure = 3, kFirstEncoder = 9, kTilt = 12, kEnable = 13;

}  // namespace

CanNodes::CanNodes(const MachineDescription& machine, const SensorErrors& errors, CanBus& port, std::uint64_t seed)
    : port_(port),
      errors_(errors),
      random_(seed),
      valves_{ValveNode(machine.bus.valves[0], machine.bus.wire.valve_full_stroke),
              ValveNode(machine.bus.valves[1], machine.bus.wire.valve_full_stroke),
              ValveNode(machine.bus.valves[2], machine.bus.wire.valve_full_stroke)},
      pressures_([&]<std::size_t... I>(std::index_sequence<I...>) {
        return std::array{SensorNode(SensorNode::Kind::kPressure, machine.bus.pressures[I],
                                     machine.sensors.pressure_step_Pa, machine.sensors.pressure_range_Pa,
                                     machine.bus.wire)...};
      }(std::make_index_sequence<6>())),
      encoders_([&]<std::size_t... I>(std::index_sequence<I...>) {
        return std::array{SensorNode(SensorNode::Kind::kEncoder, machine.bus.encoders[I],
                                     machine.sensors.encoder_step_m, machine.cylinders[I].max_length_m,
                                     machine.bus.wire)...};
      }(std::make_index_sequence<kJoints>())),
      tilt_(SensorNode::Kind::kTilt, machine.bus.tilt, machine.sensors.tilt_step_rad, std::numbers::pi),
      enable_(machine.bus.enable, machine.bus.valves, machine.bus.wire.valve_full_stroke) {
  std::size_t i = 0;
  for (ValveNode& node : valves_) all_[i++] = &node.protocol();
  for (SensorNode& node : pressures_) all_[i++] = &node.protocol();
  for (SensorNode& node : encoders_) all_[i++] = &node.protocol();
  all_[i++] = &tilt_.protocol();
  all_[i++] = &enable_.protocol();
}

void CanNodes::step(Time now, const MachineSignals& signals) noexcept {
  now_ = now;
  spool_ = signals.spool;
  out_.count = 0;
  hear(now);
  for (std::size_t j = 0; j < kJoints; ++j) step_node(j, valves_[j], signals.spool[static_cast<int>(j)]);
  step_sensors(signals);
  step_node(kEnable, enable_);
  for (std::size_t i = 0; i < out_.count; ++i) {
    // The enable node hears its neighbours over the bus, which carries nothing while it is down.
    const bool carried = port_.send(out_.frames[i]) && port_.state() == CanState::kActive;
    if (carried && !silent_[kEnable]) enable_.observe(out_.frames[i]);
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
    for (std::size_t i = 0; i < kNodes; ++i) {
      if (!silent_[i]) all_[i]->receive(frame, now, out_);
    }
    if (!silent_[kEnable]) enable_.observe(frame);
  }
}

void CanNodes::step_sensors(const MachineSignals& signals) noexcept {
  for (std::size_t i = 0; i < pressures_.size(); ++i) {
    SensorNode::Sample sample;
    if (pressures_[i].protocol().samples_now()) {
      sample.value = errors_.pressure_gain[i] * signals.pressure_Pa[i] + errors_.pressure_offset_Pa[i] +
                     noise(errors_.pressure_noise_Pa[i]);
    }
    step_node(kFirstPressure + i, pressures_[i], sample);
  }
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto axis = static_cast<int>(j);
    SensorNode::Sample sample{signals.cylinder_m[axis] + errors_.encoder_offset_m[axis], signals.cylinder_mps[axis]};
    if (encoders_[j].protocol().samples_now()) sample.value += noise(errors_.encoder_noise_m);
    step_node(kFirstEncoder + j, encoders_[j], sample);
  }
  SensorNode::Sample slope;
  if (tilt_.protocol().samples_now()) {
    slope.value = signals.slope_rad + errors_.tilt_offset_rad + noise(errors_.tilt_noise_rad);
  }
  step_node(kTilt, tilt_, slope);
}

NodeOutputs CanNodes::outputs() const noexcept {
  return {{valves_[0].demand(), valves_[1].demand(), valves_[2].demand()}, enable_.pilot()};
}

std::size_t CanNodes::index_of(std::uint8_t id) const noexcept {
  for (std::size_t i = 0; i < kNodes; ++i) {
    if (all_[i]->id() == id) return i;
  }
  return kNodes;
}

bool CanNodes::inject(std::uint8_t id, NodeFault fault) noexcept {
  const std::size_t i = index_of(id);
  if (i == kNodes) return false;
  const bool valve = i < kFirstPressure;
  const bool encoder = i >= kFirstEncoder && i < kTilt;
  if ((fault == NodeFault::kStuck && !valve) || (fault == NodeFault::kBrokenWire && !encoder)) return false;
  if (fault == NodeFault::kSpike && (valve || i == kEnable)) return false;
  const bool own = fault == NodeFault::kNone || fault == NodeFault::kSilent;
  if (i == kEnable && !own) return false;
  silent_[i] = fault == NodeFault::kSilent;
  if (valve) {
    valves_[i].inject(fault, spool_[static_cast<int>(i)]);
  } else if (i < kFirstEncoder) {
    pressures_[i - kFirstPressure].inject(fault, now_);
  } else if (encoder) {
    encoders_[i - kFirstEncoder].inject(fault, now_);
  } else if (i == kTilt) {
    tilt_.inject(fault, now_);
  }
  return true;
}

bool CanNodes::send_emcy(std::uint8_t id, std::uint16_t code) noexcept {
  const std::size_t i = index_of(id);
  if (i == kNodes || silent_[i]) return false;
  return port_.send(canopen::emergency_frame(id, {code, static_cast<std::uint8_t>(code == 0 ? 0 : 1), {}}));
}

bool CanNodes::set_product(std::uint8_t id, std::uint32_t product) noexcept {
  NodeProtocol* protocol = node(id);
  if (protocol != nullptr) protocol->replace(canopen::kProductCode, product);
  return protocol != nullptr;
}

NodeProtocol* CanNodes::node(std::uint8_t id) noexcept {
  const std::size_t i = index_of(id);
  return i == kNodes ? nullptr : all_[i];
}

}  // namespace knuckle::sim
