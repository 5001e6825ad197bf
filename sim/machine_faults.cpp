#include "sim/machine_faults.h"

#include <algorithm>

#include "transport/can_load.h"
#include "transport/canopen.h"

namespace knuckle::sim {
namespace {

constexpr double kBabbledLoad = 0.95;
constexpr int kForeignPeriod_ms = 50;
constexpr CanFrame kBabbled{.id = 0x001, .size = 8, .data = {}};  // before all but NMT

}  // namespace

MachineFaults::MachineFaults(const BusDescription& bus, double bus_load) noexcept
    : bus_(bus), babble_bits_per_ms_(1e-3 * bus.bit_rate * std::max(0.0, kBabbledLoad - bus_load)) {}

void MachineFaults::set(FaultKind kind, std::uint8_t node, bool broken, MachineOnBus& far) noexcept {
  SimulatedMachine& machine = far.machine();
  FaultyPort& port = far.nodes_end();
  const auto inject = [&](NodeFault fault) { machine.inject(node, broken ? fault : NodeFault::kNone); };
  switch (kind) {
    case FaultKind::kNodeSilent:
      return inject(NodeFault::kSilent);
    case FaultKind::kSensorFrozen:
      return inject(NodeFault::kFrozen);
    case FaultKind::kSensorInvalid:
      return inject(NodeFault::kInvalid);
    case FaultKind::kEncoderBroken:
      return inject(NodeFault::kBrokenWire);
    case FaultKind::kValveStuck:
      return inject(NodeFault::kStuck);
    case FaultKind::kEmcyStorm:
      if (!broken) machine.send_emcy(node, canopen::kEmcyReset);
      return;
    case FaultKind::kNodeEmergency:
      machine.send_emcy(node, broken ? canopen::kEmcyDeviceSpecific : canopen::kEmcyReset);
      return;
    case FaultKind::kNodeReset:
      if (broken) port.whisper(canopen::nmt_frame(canopen::NmtCommand::kResetNode, node));
      return;
    case FaultKind::kWrongIdentity:
      if (auto* there = machine.nodes().node(node)) {
        const std::uint32_t product = there->value(canopen::kProductCode);
        machine.nodes().set_product(node, product ^ 1U);  // twice is the right one again
      }
      return;
    case FaultKind::kNodeIdTwice:
      return port.double_node(node, broken);
    case FaultKind::kEStop:
      return machine.set_estop(broken);
    case FaultKind::kSyncDropped:
      return port.drop_sync(broken);
    case FaultKind::kBusCut:
      return port.cut(broken);
    case FaultKind::kBabble:
      babblers_ += broken ? 1 : -1;
      return;
    default:
      return;
  }
}

void MachineFaults::keep_up(FaultKind kind, std::uint8_t node, MachineOnBus& far) noexcept {
  if (kind == FaultKind::kEmcyStorm) far.machine().send_emcy(node, canopen::kEmcyDeviceSpecific);
  if (kind == FaultKind::kOtherController || kind == FaultKind::kForeignSender)
    send_foreign(kind, node, far.nodes_end());
  if (kind != FaultKind::kBabble) return;
  for (babble_bits_ += babble_bits_per_ms_ / babblers_; babble_bits_ >= worst_case_bits(kBabbled.size);
       babble_bits_ -= worst_case_bits(kBabbled.size)) {
    far.nodes_end().shout(kBabbled);
  }
}

void MachineFaults::send_foreign(FaultKind kind, std::uint8_t node, FaultyPort& port) noexcept {
  const bool controller = kind == FaultKind::kOtherController;
  if (++foreign_ms_[controller ? 0 : node & 0x7FU] % kForeignPeriod_ms != 0) return;
  if (controller) {
    port.shout(canopen::heartbeat_frame(bus_.controller_id, canopen::NmtState::kOperational));
    port.shout(canopen::sync_frame());
    return;
  }
  for (const NodeDescription& valve : bus_.valves) {
    if (valve.id == node) port.shout({.id = valve.rpdo_id(), .size = 4, .data = {canopen::kControlActive}});
  }
}

}  // namespace knuckle::sim
