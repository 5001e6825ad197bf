// What J1939 shows: who sends a parameter group, whose an address is, and what is lost of messages of several packets.
#include <fmt/format.h>

#include <algorithm>

#include "app/explain/cause.h"
#include "app/explain/timeline.h"
#include "app/explain/window.h"
#include "machine/reason_text.h"
#include "slave/j1939_bus.h"
#include "transport/j1939.h"

namespace knuckle::explain {
namespace {

bool near(const CanSeen& can, const Stop& stop) {
  return can.kind == WireEventKind::kCanReceived && can.at >= stop.at - Evidence::kBefore &&
         can.at <= stop.at + Evidence::kAfter;
}

/// Each sender of the group that the reason is about, near the stop.
Cause group_twice(const Stop& stop, const Window& window, const MachineDescription& machine) {
  Cause cause{"group_twice", reason_text(machine, stop.reason), {}, {}, stop.at};
  const auto place = signal_of(stop.reason);
  if (!place || *place >= kSignals.size()) return cause;
  const SignalInfo& signal = kSignals[*place];
  const BroadcastFrame* const group = machine.bus.broadcast(signal.role, signal.index).frame;
  if (group == nullptr) return cause;
  const auto other = static_cast<std::uint8_t>(stop.reason.value);
  for (const auto source : {static_cast<std::uint8_t>(stop.reason.limit), other}) {
    int times = 0;
    Time first = stop.at;
    for (const CanSeen& can : window.can) {
      if (!near(can, stop) || !group->filter().lets(can.frame.id) || j1939::source_of(can.frame.id) != source) continue;
      if (times++ == 0) first = can.at;
    }
    if (source == other) cause.since = std::min(cause.since, first);
    cause.supports.push_back(fmt::format("0x{:02X} sent it {} times, first at {}", source, times, at_text(first)));
  }
  cause.against.emplace_back("a tool that sends in a device's name looks the same as a second device");
  return cause;
}

/// Who claimed the address that commands go out from.
Cause address_lost(const Stop& stop, const Window& window, const MachineDescription& machine) {
  Cause cause{"address_lost", reason_text(machine, stop.reason), {}, {}, stop.at};
  for (const CanSeen& can : window.can) {
    CanFrame alone = can.frame;
    alone.id ^= machine.bus.j1939_line();
    const auto name = j1939::claimed_name(alone);
    if (!near(can, stop) || !name || j1939::source_of(alone.id) != machine.bus.j1939_address) continue;
    cause.since = std::min(cause.since, can.at);
    cause.supports.push_back(
        fmt::format("claimed by NAME 0x{:016X} at {}; the lower NAME has it", *name, at_text(can.at)));
  }
  return cause;
}

}  // namespace

std::optional<Cause> j1939_cause(const Stop& stop, const Window& window, const MachineDescription& machine) {
  if (stop.reason.code == ReasonCode::kGroupTwice) return group_twice(stop, window, machine);
  if (stop.reason.code == ReasonCode::kAddressLost) return address_lost(stop, window, machine);
  return std::nullopt;
}

/// As the machine's side said it, by the same frames.
std::vector<std::string> j1939_notes(const Window& window, const MachineDescription& machine) {
  slave::J1939Bus bus(machine.bus);
  std::vector<std::string> lines;
  std::uint64_t told = 0;
  for (const CanSeen& can : window.can) {
    if (can.kind != WireEventKind::kCanReceived) continue;
    CanFrame frame = can.frame;
    (void)bus.receive(frame, can.at);
    for (; told < bus.news_count(); ++told)
      lines.push_back(fmt::format("J1939, at {}: {}", at_text(can.at), slave::text(bus.news(told), machine.bus)));
  }
  return lines;
}

}  // namespace knuckle::explain
