#include "app/fault_injection.h"

#include <limits>

#include "transport/canopen.h"
#include "transport/link_messages.h"

namespace knuckle::app {
namespace {

bool takes_link_away(FaultKind kind) {
  return kind == FaultKind::kLinkCut || kind == FaultKind::kLinkNaN;
}

}  // namespace

FaultInjection::FaultInjection(std::vector<ScheduledFault> schedule, ImpairedLink& network, HidPair& cable)
    : schedule_(std::move(schedule)),
      done_(schedule_.size(), false),
      network_(network),
      cable_(cable),
      operator_end_(network.a()),
      machine_end_(network.b()) {
  injected_.reserve(schedule_.size());
}

bool FaultInjection::OperatorEnd::send(std::span<const std::uint8_t> bytes) noexcept {
  if (spoil) {
    if (auto message = decode_master(bytes)) {
      message->position_rad[kArm] = std::numeric_limits<double>::quiet_NaN();
      return link_.send(encode(*message).view());
    }
  }
  return link_.send(bytes);
}

bool FaultInjection::MachineEnd::receive(Datagram& datagram) noexcept {
  const bool received = link_.receive(datagram);
  const auto message = received ? decode_master(datagram.view()) : std::nullopt;
  if (message && (!newest || newer(message->sequence, *newest))) {
    newest = message->sequence;
    last_good = now;
  }
  return received;
}

void FaultInjection::step(Time now, int phase, Duration in_phase, sim::SimulatedMachine& machine,
                          sim::HandAndDevice& hand) noexcept {
  machine_end_.now = now;
  for (Injected& i : injected_) {
    if (i.mended_at != Time::max()) continue;
    if (takes_link_away(i.fault.kind)) i.last_good_input = machine_end_.last_good;
    if (now < i.at + from_seconds(i.fault.duration_s)) continue;
    set(i.fault, false, machine, hand);
    i.mended_at = now;
  }
  for (std::size_t n = 0; n < schedule_.size(); ++n) {
    const ScheduledFault& fault = schedule_[n];
    if (done_[n] || fault.phase != phase || to_seconds(in_phase) < fault.after_s) continue;
    done_[n] = true;
    set(fault, true, machine, hand);
    injected_.push_back({fault, now, Time::max(), takes_link_away(fault.kind) ? machine_end_.last_good : now});
  }
}

bool set_machine_fault(FaultKind kind, int subject, bool broken, sim::SimulatedMachine& machine) noexcept {
  using sim::NodeFault;
  const auto& bus = machine.plant().truth().machine.bus;
  const auto index = static_cast<std::size_t>(subject);
  const auto inject = [&](std::uint8_t id, NodeFault fault) {
    return machine.inject(id, broken ? fault : NodeFault::kNone);
  };
  const auto node = static_cast<std::uint8_t>(subject);
  switch (kind) {
    case FaultKind::kNodeSilent:
      return inject(node, NodeFault::kSilent);
    case FaultKind::kNodeEmergency:
      return machine.send_emcy(node, broken ? canopen::kEmcyDeviceSpecific : canopen::kEmcyReset);
    case FaultKind::kSensorFrozen:
      return inject(node, NodeFault::kFrozen);
    case FaultKind::kPressureInvalid:
      return inject(node, NodeFault::kInvalid);
    case FaultKind::kEncoderBroken:
      return inject(bus.encoders[index].id, NodeFault::kBrokenWire);
    case FaultKind::kValveStuck:
      return inject(bus.valves[index].id, NodeFault::kStuck);
    case FaultKind::kEStop:
      machine.set_estop(broken);
      return true;
    default:
      return false;
  }
}

void FaultInjection::set(const ScheduledFault& fault, bool broken, sim::SimulatedMachine& machine,
                         sim::HandAndDevice& hand) noexcept {
  using sim::FirmwareFault;
  const auto firmware = [&](FirmwareFault kind) { hand.firmware().inject(broken ? kind : FirmwareFault::kNone); };
  switch (fault.kind) {
    case FaultKind::kLinkCut:
      network_.cut(broken);
      break;
    case FaultKind::kLinkCutBack:
      network_.cut_b_to_a(broken);
      break;
    case FaultKind::kLinkNaN:
      operator_end_.spoil = broken;
      break;
    case FaultKind::kDeviceUnplugged:
      broken ? cable_.unplug() : cable_.plug();
      break;
    case FaultKind::kDeviceSilent:
      firmware(FirmwareFault::kSilent);
      break;
    case FaultKind::kDeviceBadCrc:
      firmware(FirmwareFault::kBadCrc);
      break;
    case FaultKind::kDeviceWild:
      firmware(FirmwareFault::kWildCounts);
      break;
    case FaultKind::kLoopHung:
      loop_hung_ = broken;
      break;
    default:
      set_machine_fault(fault.kind, fault.subject, broken, machine);
      break;
  }
}

}  // namespace knuckle::app
