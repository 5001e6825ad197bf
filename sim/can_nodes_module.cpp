// The module with analogue inputs and outputs.
#include <algorithm>

#include "sim/can_nodes.h"

namespace knuckle::sim {

namespace {

canopen::Object of_number(canopen::Object object, unsigned number) noexcept {
  return {object.index, static_cast<std::uint8_t>(number)};
}

/// As delivered: four channels a frame, from the second one on.
canopen::PdoMap default_map(canopen::Object object, unsigned pdo, unsigned channels) noexcept {
  canopen::PdoMap map;
  for (unsigned number = 1; number <= channels; ++number)
    if (analog_pdo(number) == pdo)
      map.entries.at(map.count++) = canopen::mapping(of_number(object, number), kAnalogBits);
  return map;
}

unsigned highest_input(const NodeDescription& node, const BusDescription& bus) noexcept {
  unsigned highest = 0;
  for (const BroadcastFrame& frame : bus.broadcasts) {
    for (const BroadcastField& field : frame.fields)
      if (frame.module == node.id) highest = std::max(highest, analog_number(frame.pdo, field.bits));
  }
  return highest;
}

NodeProtocol protocol_of(const NodeDescription& node, const BusDescription& bus) {
  NodeProtocol::TpdoMaps tpdos;
  std::vector<canopen::PdoMap> rpdos(NodeDescription::kMostPdos);
  for (unsigned pdo = 1; pdo < NodeDescription::kMostPdos; ++pdo) {
    tpdos[pdo] = default_map(canopen::kAnalogInput, pdo, highest_input(node, bus));
    rpdos[pdo] = default_map(canopen::kAnalogOutput, pdo, node.outputs);
  }
  return {node, tpdos, canopen::kEventDriven, rpdos};
}

}  // namespace

ModuleNode::ModuleNode(const NodeDescription& node, const BusDescription& bus)
    : protocol_(protocol_of(node, bus)), error_value_shift_(node.error_value_shift) {
  std::copy_if(bus.broadcasts.begin(), bus.broadcasts.end(), std::back_inserter(inputs_),
               [&](const BroadcastFrame& frame) { return frame.module == node.id; });
  std::copy_if(bus.commands.begin(), bus.commands.end(), std::back_inserter(outputs_),
               [&](const CommandFrame& frame) { return frame.module == node.id; });
  const unsigned inputs = highest_input(node, bus);
  sends_ = protocol_.add(canopen::kAnalogInputSends, 1, Access::kReadWrite);
  protocol_.add(of_number(canopen::kAnalogInput, 0), 1, Access::kReadOnly, inputs);
  for (unsigned number = 1; number <= inputs; ++number)
    read_.push_back(protocol_.add(of_number(canopen::kAnalogInput, number), 2, Access::kReadOnly));
  protocol_.add(of_number(canopen::kAnalogOutput, 0), 1, Access::kReadOnly, node.outputs);
  for (unsigned number = 1; number <= node.outputs; ++number) {
    told_.push_back({.value = protocol_.add(of_number(canopen::kAnalogOutput, number), 2, Access::kReadWrite),
                     .mode = protocol_.add(of_number(canopen::kOutputErrorMode, number), 1, Access::kReadWrite, 1),
                     .error = protocol_.add(of_number(canopen::kOutputErrorValue, number), 4, Access::kReadWrite)});
  }
  protocol_.add(canopen::kErrorBehaviour, 1, Access::kReadWrite);
}

/// A broken wire is that of the first input.
void ModuleNode::sense(const BroadcastFrame& frame, const BroadcastField& field, double value) noexcept {
  if (fault_ == NodeFault::kFrozen) return;
  const bool first = &field == &inputs_.front().fields.front();
  const double seen = first && fault_ == NodeFault::kInvalid ? field.analog->broken() : value;
  protocol_.set(read_[analog_number(frame.pdo, field.bits) - 1], static_cast<std::uint32_t>(raw_of(field.bits, seen)));
}

/// CiA 401: an output whose mode says so takes its error value when the device loses its controller or leaves its
/// operational state; the others stay. Until it is started the outputs have no supply.
void ModuleNode::step(Time now, Outbox& out) noexcept {
  if (protocol_.take_reset()) started_ = false;
  const bool guarded = fault_ != NodeFault::kDeadGuard;
  bool missed = false;
  for (const CommandFrame& frame : outputs_) missed = missed || (guarded && protocol_.rpdo_lost(now, frame.pdo));
  if (missed && !missed_) protocol_.emergency(canopen::kEmcyRpdoTimeout, out);
  missed_ = missed;
  if (missed) protocol_.communication_error();
  // Not over before it works again.
  if (missed || protocol_.operational()) protocol_.set_error(missed);
  const std::size_t before = out.count;
  protocol_.step(now, out);
  started_ = started_ || protocol_.operational();
  const bool works = protocol_.operational() && !missed && !(guarded && protocol_.heartbeat_lost(now));
  for (Output& output : told_) {
    if (works)
      output.now = protocol_.value(output.value);
    else if (protocol_.value(output.mode) == 1)
      output.now = protocol_.value(output.error) >> error_value_shift_;
  }
  if (protocol_.value(sends_) == 1) return;
  const auto is_input = [this](const CanFrame& frame) {
    return std::any_of(inputs_.begin(), inputs_.end(), [&](const auto& input) { return input.id == frame.id; });
  };
  auto* const begin = out.frames.begin();
  out.count = static_cast<std::size_t>(std::remove_if(begin + before, begin + out.count, is_input) - begin);
}

CanFrame ModuleNode::output_frame(std::size_t which) const noexcept {
  const CommandFrame& told = outputs_[which];
  CanFrame frame{.id = told.id, .size = told.bytes, .data = {}};
  for (const CommandField& field : told.fields) {
    const Output& output = told_[analog_number(told.pdo, field.bits) - 1];
    if (started_)
      write_raw(field.bits, output.now & 0xFFFFU, frame);
    else
      write_value(field.bits, field.neutral, frame);
  }
  return frame;
}

bool ModuleNode::inject(NodeFault fault) noexcept {
  const bool of_inputs = fault == NodeFault::kFrozen || fault == NodeFault::kInvalid;
  const bool of_outputs = fault == NodeFault::kDeadGuard;
  const bool known = fault == NodeFault::kNone || fault == NodeFault::kSilent || (of_inputs && !inputs_.empty()) ||
                     (of_outputs && !outputs_.empty());
  if (known) fault_ = fault;
  return known;
}

}  // namespace knuckle::sim
