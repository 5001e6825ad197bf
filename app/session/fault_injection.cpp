#include "app/session/fault_injection.h"

#include <algorithm>
#include <limits>

#include "machine/bus_budget.h"
#include "transport/link_messages.h"

namespace knuckle::session {
namespace {

using sim::FaultKind;

bool takes_link_away(FaultKind kind) {
  return kind == FaultKind::kLinkCut || kind == FaultKind::kLinkNaN;
}

void set_device_fault(FaultKind kind, bool broken, HandSide& hand) noexcept {
  using sim::FirmwareFault;
  const auto firmware = [&](FirmwareFault fault) {
    hand.device.firmware().inject(broken ? fault : FirmwareFault::kNone);
  };
  switch (kind) {
    case FaultKind::kDeviceUnplugged:
      return broken ? hand.cable.unplug() : hand.cable.plug();
    case FaultKind::kDeviceSilent:
      return firmware(FirmwareFault::kSilent);
    case FaultKind::kDeviceBadCrc:
      return firmware(FirmwareFault::kBadCrc);
    case FaultKind::kDeviceTruncated:
      return firmware(FirmwareFault::kTruncated);
    case FaultKind::kDeviceWild:
      return firmware(FirmwareFault::kWildCounts);
    default:
      return;
  }
}

}  // namespace

FaultInjection::FaultInjection(std::vector<ScheduledFault> schedule, ImpairedLink& network, const BusDescription& bus)
    : schedule_(std::move(schedule)),
      done_(schedule_.size(), false),
      network_(network),
      operator_end_(network.a()),
      machine_end_(network.b()),
      machine_faults_(bus, worst_bus_loads(bus)) {
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
  if (message && (!newest || newer(message->stamp.sequence, *newest))) {
    newest = message->stamp.sequence;
    last_good = now;
  }
  return received;
}

void FaultInjection::step(Time now, int phase, Duration in_phase, SimulatedMachineSide& far, HandSide& hand) noexcept {
  machine_end_.now = now;
  for (Injected& i : injected_) {
    if (i.mended_at != Time::max()) continue;
    if (takes_link_away(i.fault.kind)) i.last_good_input = machine_end_.last_good;
    if (now < i.at + from_seconds(i.fault.duration_s)) {
      if (i.fault.kind == FaultKind::kLinkSlow) network_.slow_down(std::min((now - i.at) / 4, sim::kLinkSlowBy));
      machine_faults_.keep_up(i.fault.kind, static_cast<std::uint8_t>(i.fault.subject), far.simulated);
      continue;
    }
    set(i.fault, false, far, hand);
    i.mended_at = now;
  }
  for (std::size_t n = 0; n < schedule_.size(); ++n) {
    const ScheduledFault& fault = schedule_[n];
    if (done_[n] || fault.phase != phase || to_seconds(in_phase) < fault.after_s) continue;
    done_[n] = true;
    set(fault, true, far, hand);
    injected_.push_back({fault, now, Time::max(), takes_link_away(fault.kind) ? machine_end_.last_good : now});
  }
}

void FaultInjection::set(const ScheduledFault& fault, bool broken, SimulatedMachineSide& far, HandSide& hand) noexcept {
  constexpr std::size_t kController = sim::MachineOnBus::kControllerPort;
  VirtualCanBus& bus = far.simulated.bus(concerns_bus(fault.kind) ? static_cast<std::size_t>(fault.subject) : 0);
  switch (fault.kind) {
    case FaultKind::kLinkCut:
      return network_.cut(broken);
    case FaultKind::kLinkCutBack:
      return network_.cut_b_to_a(broken);
    case FaultKind::kLinkNaN:
      operator_end_.spoil = broken;
      return;
    case FaultKind::kLinkSlow:
      return network_.slow_down(Duration::zero());  // slower from step to step
    case FaultKind::kLinkLossy:
      return network_.lose_more_b_to_a(broken ? sim::kLinkLossyShare : 0);
    case FaultKind::kClockStep:
      clock_ahead_ = broken ? sim::kClockStepBy : Duration::zero();
      return;
    case FaultKind::kLoopHung:
      loop_hung_ = broken;
      return;
    case FaultKind::kBusOff:
      return broken ? bus.bus_off(kController) : bus.recover(kController);
    case FaultKind::kCanDown:
      return bus.take_down(kController, broken);
    case FaultKind::kNoAcknowledge:
      return bus.disturb(kController, broken);
    case FaultKind::kBusCut:  // at the controller's end: it is the nodes that are watched
      return bus.disconnect(kController, broken);
    default:
      set_device_fault(fault.kind, broken, hand);
      machine_faults_.set(fault.kind, static_cast<std::uint8_t>(fault.subject), broken, far.simulated);
  }
}

}  // namespace knuckle::session
