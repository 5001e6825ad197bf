// The seconds around one stop, out of a recording: what crossed the wires and what the loops knew.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description.h"
#include "master/master_state.h"
#include "recording/recording.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"
#include "transport/can_bus.h"
#include "transport/hid_reports.h"
#include "transport/link_messages.h"

namespace knuckle::explain {

using recording::WireEventKind;

/// Something stopped the machine.
struct Stop {
  Time at{};
  Mode before = Mode::kOff;  ///< Mode until then.
  Mode mode = Mode::kFault;
  Reason reason;
  /// The operator's side heard no more of the machine's side; nothing tells that the machine has noticed a fault.
  bool machine_unheard = false;
};

struct CanSeen {
  Time at{};
  WireEventKind kind{};  ///< kCanReceived, kCanSent, kCanRefused
  CanFrame frame;
};
struct LinkSeen {
  Time at{};
  WireEventKind kind{};     ///< kLinkReceived, kLinkSent, kLinkRefused
  bool understood = false;  ///< It is a message of this version, with possible numbers.
};
struct HidSeen {
  Time at{};
  WireEventKind kind{};  ///< kHidReceived, kHidSent, kHidRefused
  bool sound = false;    ///< Of those received: a report with a right check sum.
  int zeros = 0;         ///< Of those received: bytes at the end that are zero.
  std::optional<DeviceState> state;
};
/// kCanState, kHidConnected, kCanAcknowledged.
struct WireChange {
  Time at{};
  WireEventKind kind{};
  std::uint32_t value = 0;
};
struct StepMark {
  Time at{};
  std::uint32_t number = 0;
};

/// All in the order of their times.
struct Window {
  Time from{}, to{};  ///< Of what is in it.
  std::vector<StepMark> machine_steps, operator_steps;
  std::vector<slave::SlaveState> machine;
  std::vector<master::MasterState> operator_states;
  std::vector<CanSeen> can;
  std::vector<LinkSeen> machine_link, operator_link;
  std::vector<HidSeen> hid;
  std::vector<WireChange> changes;
};

/// What find_stops() learned on its way through the whole recording.
struct Survey {
  std::vector<Stop> stops;
  Time first{}, last{};  ///< Steps of any loop; both zero where there is none.
  std::uint64_t machine_steps = 0, operator_steps = 0;
  bool begins_stopped = false;  ///< The machine was in fault or E-stop in the first step.
  Reason began_with;            ///< Why, then.
};

/// Whose loop's part of a recording is looked at. A real machine's sides have a recording each; one of a simulation has
/// both.
struct Sides {
  bool operator_side = true, machine_side = true;
};

/// Reads from the beginning to the end. @param bus of the recorded machine
[[nodiscard]] Survey find_stops(recording::Recording& recording, Sides sides, const BusDescription& bus);
/// @param from, to of the window, both included.
[[nodiscard]] Window load_window(recording::Recording& recording, Sides sides, Time from, Time to);

// Names and numbers as a person reads them.

/// "12.340 s"
[[nodiscard]] std::string at_text(Time at);
/// "35 ms"; from 10 s on "12.3 s".
[[nodiscard]] std::string span_text(Duration span);
/// The one line of a reason, and of an EMCY code its meaning.
[[nodiscard]] std::string reason_text(const MachineDescription& machine, const Reason& reason);

}  // namespace knuckle::explain
