// Causes on the wires: other senders on the bus, the haptic device, the link.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/explain/cause.h"
#include "app/explain/window.h"
#include "core/frame_words.h"
#include "machine/bus_description.h"
#include "machine/bus_frames.h"
#include "machine/reason_text.h"
#include "slave/bus_map.h"
#include "transport/canopen.h"

namespace knuckle::explain {
namespace {

struct Heard {
  Time first{};
  int times = 0;
};
using HeardById = std::map<std::uint32_t, Heard>;

/// What arrived under these identifiers near the stop.
HeardById heard(const Window& window, const Stop& stop, const auto& wanted) {
  HeardById found;
  for (const CanSeen& can : window.can) {
    const bool near = can.at >= stop.at - Evidence::kBefore && can.at <= stop.at + Evidence::kAfter;
    if (can.kind != WireEventKind::kCanReceived || !near || !wanted(can.frame.id)) continue;
    Heard& one = found.try_emplace(can.frame.id, Heard{can.at}).first->second;
    ++one.times;
  }
  return found;
}

/// Cause by foreign frames; the first of them is the first sign.
Cause by_foreign(const char* id, const std::string& text, const HeardById& frames, Time stopped) {
  Cause cause{id, text, {}, {}, stopped};
  for (const auto& [identifier, one] : frames) {
    cause.since = std::min(cause.since, one.first);
    cause.supports.push_back(
        fmt::format("{} arrived {} time{}, first at {}",
                    identifier > kMostId ? id_text(identifier) : controllers_frame_text(identifier), one.times,
                    one.times == 1 ? "" : "s", at_text(one.first)));
  }
  cause.supports.emplace_back("the controller does not receive its own frames: somebody else sent these");
  cause.against.emplace_back("another program on this computer and another device on the bus look the same");
  return cause;
}

Cause other_controller(const Stop& stop, const Window& window, const MachineDescription& machine) {
  const std::vector<std::uint32_t> own = slave::controllers_own(machine.bus);
  std::vector<CanFilter> filters = slave::set_point_filters(machine.bus);
  filters.insert(filters.end(), own.begin(), own.end());
  const auto wanted = [&](std::uint32_t id) { return slave::hears(filters, id); };
  return by_foreign("other_controller",
                    "another controller is on the machine's bus: stop one of the two, as each may reset the nodes that "
                    "the other leads",
                    heard(window, stop, wanted), stop.at);
}

Cause foreign_sender(const Stop& stop, const Window& window, const MachineDescription& machine) {
  const auto id = static_cast<std::uint32_t>(stop.reason.value);
  return by_foreign("foreign_sender",
                    node_text(stop.reason.subject, machine.bus) +
                        " is commanded by somebody else on the bus: find the sender and take it off",
                    heard(window, stop, [id](std::uint32_t one) { return one == id; }), stop.at);
}

Cause node_id_twice(const Stop& stop, const Window& window, const MachineDescription& machine) {
  const std::uint8_t node = stop.reason.subject;
  Cause cause{"node_id_twice",
              "two devices send under the node id of " + node_text(node, machine.bus) +
                  ": take one off the bus, or give it another id; until then either one's values may have been used",
              {},
              {},
              stop.at};
  const std::vector<BusFrame> frames = bus_frames(machine.bus);
  const auto from_node = [&](std::uint32_t id) {
    const bool process_data = std::any_of(frames.begin(), frames.end(), [&](const BusFrame& frame) {
      return !frame.to_node && frame.id == id && machine.bus.nodes[frame.node].id == node;
    });
    return process_data || id == canopen::heartbeat_id(node) || id == canopen::emcy_id(node) ||
           id == canopen::sdo_response_id(node);
  };
  const auto syncs = std::count_if(window.can.begin(), window.can.end(), [&](const CanSeen& can) {
    return can.kind == WireEventKind::kCanSent && can.frame.id == canopen::kSyncId &&
           can.at >= stop.at - Evidence::kBefore && can.at <= stop.at + Evidence::kAfter;
  });
  for (const auto& [identifier, one] : heard(window, stop, from_node))
    cause.supports.push_back(
        fmt::format("0x{:03X} arrived {} times while SYNC was sent {} times", identifier, one.times, syncs));
  cause.against.emplace_back("a tool that sends in the node's name looks the same as a second device");
  return cause;
}

}  // namespace

std::optional<Cause> bus_cause(const Stop& stop, const Window& window, const MachineDescription& machine) {
  switch (stop.reason.code) {
    case ReasonCode::kOtherController:
      return other_controller(stop, window, machine);
    case ReasonCode::kForeignSender:
      return foreign_sender(stop, window, machine);
    case ReasonCode::kNodeIdTwice:
      return node_id_twice(stop, window, machine);
    default:
      return std::nullopt;
  }
}

namespace {

constexpr int kCutShort = 8;  // zeros at the end that no whole report has: the check sum is there

bool of_device(ReasonCode code) {
  switch (code) {
    case ReasonCode::kDeviceLost:
    case ReasonCode::kDeviceStale:
    case ReasonCode::kDeviceReport:
    case ReasonCode::kDeviceFault:
    case ReasonCode::kDeviceIdentity:
    case ReasonCode::kStartingUp:  // a device whose self test runs again
      return true;
    default:
      return false;
  }
}

std::string reports_text(const Evidence& evidence) {
  if (!evidence.reports.last) return "no sound report is in the recording";
  return fmt::format("newest sound report at {} (usual every {:.1f} ms){}", at_text(*evidence.reports.last),
                     1e3 * to_seconds(evidence.reports.usual),
                     evidence.reports.next ? ", the next at " + at_text(*evidence.reports.next) : ", none after it");
}

Cause damaged(const Evidence& evidence, Time since) {
  const std::string count =
      fmt::format("{} reports in a row were damaged; {}", evidence.damaged_reports, reports_text(evidence));
  if (evidence.zeros >= kCutShort) {
    return {"device_reports_cut_short",
            fmt::format("the haptic device's reports end early: only {} of their 64 bytes have content; check its "
                        "firmware and USB",
                        64 - evidence.zeros),
            {count, "reports kept coming: cable and firmware are alive"},
            {},
            since};
  }
  return {"device_reports_damaged",
          "the haptic device's reports arrive whole, but their check sum (CRC) is wrong: damaged by cable, USB or "
          "firmware",
          {count, "reports kept coming, of full length: neither unplugged nor silent"},
          {},
          since};
}

}  // namespace

std::optional<Cause> device_cause(const Stop& stop, const Window& window, const Evidence& evidence) {
  if (!of_device(stop.reason.code)) return std::nullopt;
  const Time since = evidence.reports.last.value_or(stop.at);
  if (window.operator_steps.empty())
    return Cause{"device",
                 "the haptic device: the operator's side said \"" + text(stop.reason) + "\"",
                 {"the operator's messages kept coming: link and program there are sound"},
                 {"the device's own wire is not in this recording: see that of the operator's side"},
                 stop.at};
  if (evidence.unplugged)
    return Cause{"device_unplugged",
                 "the haptic device was disconnected at " + at_text(*evidence.unplugged) +
                     ": its cable was pulled or it lost power",
                 {"USB reported it as gone; " + reports_text(evidence)},
                 {"a device that only hangs would stay connected"},
                 *evidence.unplugged};
  if (evidence.damaged_reports > 0) return damaged(evidence, since);
  if (evidence.reports.silent())
    return Cause{
        "device_silent",
        "the haptic device stopped sending at " + at_text(since) + " although it stayed connected: its firmware hangs",
        {reports_text(evidence), "USB never reported it as gone, and no damaged report came"},
        {},
        since};
  if (stop.reason.code == ReasonCode::kDeviceReport)
    return Cause{"device_values_impossible",
                 "the haptic device sends values that cannot be, in reports that are sound: its encoders or its "
                 "firmware are faulty",
                 {"the check sum of its reports is right: not the cable; " + reports_text(evidence)},
                 {},
                 stop.at};
  return Cause{"device_says_so",
               "the haptic device cannot be used, by its own account: " + text(stop.reason),
               {"its reports kept coming with a right check sum; " + reports_text(evidence)},
               {"a jump of the operator's clock makes its reports look old"},
               stop.at};
}

namespace {

std::string silence(const Stream& stream) {
  return fmt::format("last at {} (usual every {}){}", at_text(*stream.last), span_text(stream.usual),
                     stream.next ? ", next at " + at_text(*stream.next) : ", none after it");
}

Cause unheard(const Stop& stop, const Window& window, const Evidence& evidence) {
  const Time since = evidence.to_operator.last.value_or(stop.at);
  Cause cause{"machine_unheard",
              "the machine's side fell silent at " + at_text(since) +
                  ": its program or computer died, or the way back from it is cut",
              {},
              {},
              since};
  cause.supports.push_back("the operator's side went on running and sending, and received nothing");
  const bool machine_recorded = !window.machine_steps.empty();
  const bool ran_on = machine_recorded && window.machine_steps.back().at > since + 100ms;
  if (!machine_recorded) {
    cause.against.emplace_back(
        "a dead program and a cut network look the same from here: see the recording of the machine's side");
  } else if (ran_on) {
    cause.id = "link_one_way_back";
    cause.text = "the way from the machine to the operator is cut since " + at_text(since) +
                 ": the machine's side ran on and sent, and nothing of it arrived";
  } else {
    cause.id = "machine_program_gone";
    cause.text = "the machine's program ended or hangs since " + at_text(window.machine_steps.back().at) +
                 ": it was killed, crashed, or its computer lost power";
    cause.supports.push_back("its loop has no step in the recording after " + at_text(window.machine_steps.back().at) +
                             ", while the operator's side has");
    cause.against.emplace_back("a cut network would have left the machine's own steps in the recording");
  }
  return cause;
}

Cause operator_gone(const Evidence& evidence, const Pause& pause, Time since) {
  const bool again = evidence.from_operator.next.has_value();
  return {"operator_program_paused",
          fmt::format("the operator's program {} from {} on{}",
                      again ? "was stopped or hung" : "ended, was killed or hangs", at_text(pause.from),
                      again ? " until " + at_text(pause.to) : ""),
          {"its loop has no step in the recording meanwhile, and sent nothing",
           "the machine's side ran and sent all the time"},
          {"the network is not to blame: there was nothing to carry"},
          since};
}

}  // namespace

std::optional<Cause> link_cause(const Stop& stop, const Window& window, const Evidence& evidence) {
  if (stop.machine_unheard) return unheard(stop, window, evidence);
  if (stop.reason.code != ReasonCode::kLinkLost) return std::nullopt;
  const Stream& heard = evidence.to_machine;
  const Time since = heard.last.value_or(stop.at);
  if (evidence.not_understood > 0) {
    return Cause{"link_content_damaged",
                 fmt::format("the operator's datagrams kept arriving, but none could be used since {}: impossible "
                             "numbers (not finite, out of range) or another version",
                             at_text(since)),
                 {fmt::format("{} datagrams in a row were refused", evidence.not_understood)},
                 {"the network is not to blame: it carried them; check the operator's program"},
                 since};
  }
  if (evidence.operator_pause && !window.operator_steps.empty())
    return operator_gone(evidence, *evidence.operator_pause, since);
  Cause cause{"link_cut", "", {}, {}, since};
  if (heard.last) cause.supports.push_back("the operator's messages as received by the machine: " + silence(heard));
  if (evidence.from_machine.last && !evidence.from_machine.silent())
    cause.supports.emplace_back("the machine's own datagrams kept leaving: its program is sound");
  if (window.operator_steps.empty()) {
    cause.text = "the operator's datagrams stopped arriving at " + at_text(since) +
                 " while the machine's own kept leaving: the network is cut, or the operator's program or computer "
                 "was stopped, killed, or lost power";
    cause.against.emplace_back(
        "which of the two it is cannot be told from the machine's side: see the recording of the operator's side");
    return cause;
  }
  if (!evidence.from_operator.silent())
    cause.supports.emplace_back("the operator's side went on sending: its program is sound");
  const bool back_too = evidence.to_operator.silent();
  cause.id = back_too ? "link_cut" : "link_one_way";
  cause.text = back_too ? "the network between the two sides is cut, both ways, since " + at_text(since) +
                              ": both went on sending, and neither heard the other"
                        : "the network is cut from the operator to the machine since " + at_text(since) +
                              ": the operator's side went on sending and hearing, the machine's side heard nothing";
  if (back_too && evidence.to_operator.last)
    cause.supports.push_back("the machine's messages as received by the operator: " + silence(evidence.to_operator));
  return cause;
}

}  // namespace knuckle::explain
