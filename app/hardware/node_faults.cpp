#include "app/hardware/node_faults.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "app/command.h"
#include "app/csv_mapping.h"
#include "app/fault_injection.h"
#include "app/hardware/program_options.h"
#include "machine/load.h"
#include "transport/canopen.h"
#include "transport/virtual_can.h"

namespace knuckle::app {
namespace {

constexpr double kBabbledLoad = 0.95, kLatest_s = 1e6;
constexpr CanFrame kBabbled{.id = 0x001, .size = 8, .data = {}};  // before all but NMT

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  refuse_option("--fault", text, why);
}

/// Which kind concerns a node, and of which kind of node.
bool concerns_node(NodeFaultKind kind) {
  switch (kind) {
    case NodeFaultKind::kEStop:
    case NodeFaultKind::kSyncDropped:
    case NodeFaultKind::kBusCut:
    case NodeFaultKind::kBabble:
      return false;
    default:
      return true;
  }
}

template <std::size_t N>
int index_of(const std::array<NodeDescription, N>& nodes, std::uint8_t id) {
  const auto found = std::find_if(nodes.begin(), nodes.end(), [id](const auto& n) { return n.id == id; });
  return found == nodes.end() ? -1 : static_cast<int>(found - nodes.begin());
}

double seconds_in(const std::string& text, const std::string& cell, const char* what) {
  const double value = number_in(cell);
  if (std::isfinite(value) && value >= 0 && value <= kLatest_s) return value;
  refuse(text, std::string(what) + " \"" + cell + "\" must be seconds from 0 to 1e6");
}

std::uint8_t node_in(const std::string& text, const std::string& cell, NodeFaultKind kind, const BusDescription& bus) {
  const auto nodes = named_nodes(bus);
  const bool hex = cell.rfind("0x", 0) == 0;
  unsigned id = 0;
  const char* first = cell.data() + (hex ? 2 : 0);
  const char* last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(first, last, id, hex ? 16 : 10);
  const bool number = error == std::errc() && end == last;
  const auto found = std::find_if(nodes.begin(), nodes.end(),
                                  [&](const NamedNode& n) { return number ? n.node.id == id : n.name == cell; });
  if (found == nodes.end()) {
    std::string known;
    for (const NamedNode& n : nodes) known += (known.empty() ? "" : ", ") + n.name;
    refuse(text, "no node \"" + cell + "\"; there are " + known);
  }
  const std::uint8_t node = found->node.id;
  if (kind == NodeFaultKind::kValveStuck && index_of(bus.valves, node) < 0) refuse(text, "only a valve can be stuck");
  if (kind == NodeFaultKind::kEncoderBroken && index_of(bus.encoders, node) < 0)
    refuse(text, "only an encoder has a wire");
  const bool by_nature = kind == NodeFaultKind::kFrozen || kind == NodeFaultKind::kInvalid;
  if (by_nature && node == bus.enable.id) refuse(text, "the enable node cannot do that");
  return node;
}

}  // namespace

PlannedFault parse_fault(const std::string& text, const BusDescription& bus) {
  PlannedFault fault;
  fault.text = text;
  const auto at = text.find('@');
  if (at == std::string::npos) refuse(text, "must be KIND[:NODE]@S[+D], such as node_silent:boom_valve@10+2");
  const std::string what = text.substr(0, at), when = text.substr(at + 1);
  const auto colon = what.find(':');
  const std::string kind = what.substr(0, colon);
  const auto named = std::find(kNodeFaultNames.begin(), kNodeFaultNames.end(), kind);
  if (named == kNodeFaultNames.end()) {
    std::string known;
    for (const char* name : kNodeFaultNames) known += std::string(known.empty() ? "" : ", ") + name;
    refuse(text, "no fault \"" + kind + "\"; there are " + known);
  }
  fault.kind = static_cast<NodeFaultKind>(named - kNodeFaultNames.begin());
  const bool given = colon != std::string::npos;
  if (concerns_node(fault.kind) != given)
    refuse(text, given ? kind + " concerns no single node" : "needs a node: " + kind + ":NODE@S");
  if (given) fault.node = node_in(text, what.substr(colon + 1), fault.kind, bus);
  const auto plus = when.find('+');
  const std::string start = when.substr(0, plus);
  if (start != "usr1") fault.at_s = seconds_in(text, start, "start");
  if (plus != std::string::npos) fault.duration_s = seconds_in(text, when.substr(plus + 1), "duration");
  return fault;
}

bool FaultyPort::send(const CanFrame& frame) noexcept {
  return cut_ || bus_.send(frame);  // who is cut off believes that it was sent
}

bool FaultyPort::receive(CanFrame& frame) noexcept {
  if (whispered_) {
    frame = *whispered_;
    whispered_.reset();
    return true;
  }
  while (bus_.receive(frame)) {
    if (!cut_ && !(drop_sync_ && frame.id == canopen::kSyncId)) return true;
  }
  return false;
}

NodeFaults::NodeFaults(std::vector<PlannedFault> plan, const BusDescription& bus, FaultyPort& port)
    : plan_(std::move(plan)),
      state_(plan_.size()),
      bus_(bus),
      port_(port),
      babble_bits_per_ms_(1e-3 * bus.bit_rate * std::max(0.0, kBabbledLoad - worst_bus_load(bus))) {}

bool NodeFaults::toggle(std::size_t index, Time now, bool signalled, sim::SimulatedMachine& machine) noexcept {
  const PlannedFault& fault = plan_[index];
  State& state = state_[index];
  if (state.broken) {
    if (to_seconds(now - state.at) < fault.duration_s) return false;
  } else {
    const bool due = fault.at_s ? to_seconds(now) >= *fault.at_s : signalled;
    if (state.done || !due) return false;
  }
  state.broken = !state.broken;
  state.at = now;
  state.done = fault.at_s.has_value();
  set(fault, state.broken, machine);
  return true;
}

void NodeFaults::set(const PlannedFault& fault, bool broken, sim::SimulatedMachine& machine) noexcept {
  const auto pass_on = [&](FaultKind kind, int subject) { set_machine_fault(kind, subject, broken, machine); };
  switch (fault.kind) {
    case NodeFaultKind::kSilent:
      return pass_on(FaultKind::kNodeSilent, fault.node);
    case NodeFaultKind::kEmergency:
      return pass_on(FaultKind::kNodeEmergency, fault.node);
    case NodeFaultKind::kFrozen:
      return pass_on(FaultKind::kSensorFrozen, fault.node);
    case NodeFaultKind::kInvalid:
      return pass_on(FaultKind::kPressureInvalid, fault.node);
    case NodeFaultKind::kEncoderBroken:
      return pass_on(FaultKind::kEncoderBroken, index_of(bus_.encoders, fault.node));
    case NodeFaultKind::kValveStuck:
      return pass_on(FaultKind::kValveStuck, index_of(bus_.valves, fault.node));
    case NodeFaultKind::kEStop:
      return pass_on(FaultKind::kEStop, 0);
    case NodeFaultKind::kReset:
      if (broken) port_.whisper(canopen::nmt_frame(canopen::NmtCommand::kResetNode, fault.node));
      return;
    case NodeFaultKind::kWrongIdentity:
      if (auto* node = machine.nodes().node(fault.node)) {
        const std::uint32_t product = node->value(canopen::kProductCode);
        machine.nodes().set_product(fault.node, product ^ 1U);  // twice is the right one again
      }
      return;
    case NodeFaultKind::kEmcyStorm:
      if (!broken) pass_on(FaultKind::kNodeEmergency, fault.node);
      return;
    case NodeFaultKind::kSyncDropped:
      return port_.drop_sync(broken);
    case NodeFaultKind::kBusCut:
      return port_.cut(broken);
    case NodeFaultKind::kBabble:
      babble_bits_ = 0;
      return;
  }
}

void NodeFaults::keep_up(const PlannedFault& fault, sim::SimulatedMachine& machine) noexcept {
  if (fault.kind == NodeFaultKind::kEmcyStorm) set_machine_fault(FaultKind::kNodeEmergency, fault.node, true, machine);
  if (fault.kind != NodeFaultKind::kBabble) return;
  for (babble_bits_ += babble_bits_per_ms_; babble_bits_ >= worst_case_bits(kBabbled.size);
       babble_bits_ -= worst_case_bits(kBabbled.size)) {
    port_.shout(kBabbled);
  }
}

}  // namespace knuckle::app
