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

void FaultInjection::set(const ScheduledFault& fault, bool broken, sim::SimulatedMachine& machine,
                         sim::HandAndDevice& hand) noexcept {
  using sim::FirmwareFault;
  using sim::NodeFault;
  const auto node = static_cast<std::uint8_t>(fault.subject);
  const auto inject = [&](std::uint8_t id, NodeFault kind) { machine.inject(id, broken ? kind : NodeFault::kNone); };
  const auto firmware = [&](FirmwareFault kind) { hand.firmware().inject(broken ? kind : FirmwareFault::kNone); };
  const auto& bus = machine.plant().truth().machine.bus;
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
    case FaultKind::kNodeSilent:
      inject(node, NodeFault::kSilent);
      break;
    case FaultKind::kNodeEmergency:
      machine.send_emcy(node, broken ? canopen::kEmcyDeviceSpecific : canopen::kEmcyReset);
      break;
    case FaultKind::kSensorFrozen:
      inject(node, NodeFault::kFrozen);
      break;
    case FaultKind::kPressureInvalid:
      inject(node, NodeFault::kInvalid);
      break;
    case FaultKind::kEncoderBroken:
      inject(bus.encoders[node].id, NodeFault::kBrokenWire);
      break;
    case FaultKind::kValveStuck:
      inject(bus.valves[node].id, NodeFault::kStuck);
      break;
    case FaultKind::kEStop:
      machine.set_estop(broken);
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
  }
}

}  // namespace knuckle::app
