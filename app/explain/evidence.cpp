#include "app/explain/evidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "machine/reason_text.h"
#include "slave/bus_map.h"
#include "slave/valve_monitor.h"
#include "transport/j1939.h"

namespace knuckle::explain {
namespace {

constexpr Duration kOperatorPause = 50ms;  // fifty of its periods
constexpr Duration kAfterStop = 200ms;
constexpr double kApart = slave::ValveMonitor::kTolerance;
constexpr double kStill = 0.002;  // of stroke; a spool that follows moves by more from one status to the next
constexpr double kLag_s = slave::ValveMonitor::kWindow_s;

/// Steps in which something came, in their order.
class Times {
 public:
  void add(Time at) {
    if (all_.empty() || all_.back() != at) all_.push_back(at);
  }
  [[nodiscard]] Stream around(Time moment, Time known_until) const {
    Stream stream;
    stream.known_until = std::max(known_until, moment);
    const auto behind = std::upper_bound(all_.begin(), all_.end(), moment);
    if (behind != all_.begin()) stream.last = *(behind - 1);
    if (behind != all_.end()) stream.next = *behind;
    std::vector<Duration> distances;
    for (auto at = all_.begin(); at != behind && at + 1 != behind; ++at) distances.push_back(*(at + 1) - *at);
    if (distances.size() >= 3) {
      const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
      std::nth_element(distances.begin(), middle, distances.end());
      stream.usual = *middle;
    }
    return stream;
  }

 private:
  std::vector<Time> all_;
};

void note_value(ChannelSeen& seen, const CanSeen& can) {
  const auto same = [&](const FrameField& field) {
    return read_raw(field.bits, *seen.newest) == read_raw(field.bits, can.frame);
  };
  if (seen.newest && std::all_of(seen.fields.begin(), seen.fields.end(), same)) {
    ++seen.same_times;
  } else {
    if (seen.same_since) seen.longest_same = std::max(seen.longest_same, can.at - *seen.same_since);
    seen.same_since = can.at;
    seen.same_times = 1;
  }
  seen.newest = can.frame;
}

void note_identity(const CanSeen& can, const NodeSeen& seen, Evidence& evidence) {
  const auto answer = canopen::parse_sdo_response(can.frame);
  if (!answer || answer->kind != canopen::SdoResponse::Kind::kUploaded) return;
  const NodeDescription& node = seen.node;
  const auto expected = answer->object == canopen::kDeviceType    ? std::optional(node.device_type)
                        : answer->object == canopen::kVendorId    ? std::optional(node.vendor)
                        : answer->object == canopen::kProductCode ? std::optional(node.product)
                                                                  : std::nullopt;
  if (!expected || *expected == answer->value) return;
  evidence.other_identity = answer;
  evidence.other_node = node.id;
  evidence.expected_identity = *expected;
}

bool around(Time at, const Stop& stop) {
  return at >= stop.at - Evidence::kBefore && at <= stop.at + Evidence::kAfter;
}

/// A node of which nothing has been seen yet.
NodeSeen unseen(const NodeDescription& node, const MachineDescription& machine) {
  NodeSeen seen;
  seen.node = node;
  BusDescription alone = machine.bus;
  alone.nodes = {node};
  for (const BusFrame& frame : bus_frames(alone, machine.sensors)) {
    if (frame.to_node) continue;
    seen.pdos.push_back({fmt::format("TPDO{}", frame.pdo + 1), frame.id, {}});
    for (const FrameField& field : frame.fields) {
      auto channel = std::find_if(seen.channels.begin(), seen.channels.end(),
                                  [&](const ChannelSeen& one) { return one.channel == field.channel; });
      if (channel == seen.channels.end()) {
        channel = seen.channels.emplace(channel);
        channel->channel = field.channel;
        channel->id = frame.id;
      }
      channel->fields.push_back(field);
    }
  }
  for (const BroadcastFrame& inputs : machine.bus.broadcasts)
    if (inputs.module == node.id) seen.pdos.push_back({fmt::format("TPDO{}", inputs.pdo + 1), inputs.id, {}});
  return seen;
}

/// Of several PDOs the one that has been missing longest, else the first.
Stream missing_first(const std::vector<PdoSeen>& pdos) {
  const auto since = [](const PdoSeen& pdo) { return pdo.frames.silent() ? *pdo.frames.last : Time::max(); };
  const auto first = std::min_element(pdos.begin(), pdos.end(),
                                      [&](const PdoSeen& a, const PdoSeen& b) { return since(a) < since(b); });
  return first == pdos.end() ? Stream{} : first->frames;
}

NodeSeen node_seen(const NodeDescription& node, const MachineDescription& machine, const Stop& stop,
                   const Window& window, Evidence& evidence) {
  NodeSeen seen = unseen(node, machine);
  std::vector<Times> data(seen.pdos.size());
  Times heartbeats;
  Time told_to_start = kNever;
  for (const CanSeen& can : window.can) {
    if (can.kind == WireEventKind::kCanSent && can.frame.id == canopen::kNmtId) told_to_start = can.at;
    if (can.kind != WireEventKind::kCanReceived) continue;
    const std::uint32_t id = can.frame.id;
    const auto pdo =
        std::find_if(seen.pdos.begin(), seen.pdos.end(), [id](const PdoSeen& one) { return one.id == id; });
    if (pdo != seen.pdos.end()) {
      data[static_cast<std::size_t>(pdo - seen.pdos.begin())].add(can.at);
      for (ChannelSeen& channel : seen.channels)
        if (channel.id == id && can.at <= stop.at) note_value(channel, can);
    } else if (id == canopen::heartbeat_id(node.id)) {
      heartbeats.add(can.at);
      const auto state = canopen::parse_heartbeat(can.frame);
      const bool near = can.at <= stop.at && stop.at - can.at <= Evidence::kBefore;
      const bool told = can.at - told_to_start <= Evidence::kBefore;
      if (near && !told && state == canopen::NmtState::kBootUp) seen.booted = can.at;
      const bool stands = state == canopen::NmtState::kStopped || state == canopen::NmtState::kPreOperational;
      if (stands && !told && !seen.left && around(can.at, stop)) {
        seen.left = can.at;
        seen.left_to = *state;
      }
    } else if (id == canopen::emcy_id(node.id)) {
      const auto emergency = canopen::parse_emergency(can.frame);
      if (around(can.at, stop) && emergency && emergency->code != canopen::kEmcyReset)
        seen.emergencies.push_back({can.at, *emergency});
    } else if (id == canopen::sdo_response_id(node.id) && can.at <= stop.at) {
      note_identity(can, seen, evidence);
    }
  }
  for (std::size_t i = 0; i < data.size(); ++i) seen.pdos[i].frames = data[i].around(stop.at, window.to);
  seen.heartbeat = heartbeats.around(stop.at, window.to);
  seen.data = seen.pdos.empty() ? seen.heartbeat : missing_first(seen.pdos);  // a module may have outputs alone
  return seen;
}

FrameSeen frame_seen(const BroadcastFrame& frame, const BusDescription& bus, const Stop& stop, const Window& window) {
  FrameSeen seen{.frame = &frame, .name = frame_text(frame, bus), .stream = {}, .counted = {}};
  const auto& counter = frame.closing.counter;
  std::optional<std::uint64_t> count;
  Times all;
  for (const CanSeen& can : window.can) {
    const bool its = can.kind == WireEventKind::kCanReceived && frame.filter().lets(can.frame.id) &&
                     (!frame.source || j1939::source_of(can.frame.id) == *frame.source) && frame.is_in(can.frame);
    if (!its) continue;
    all.add(can.at);
    if (!counter || can.at > stop.at) continue;
    const auto now = read_raw(counter->field, can.frame);
    if (now != count) seen.counted = can.at;
    count = now;
  }
  seen.stream = all.around(stop.at, window.to);
  return seen;
}

/// What the enable node, or the machine by itself, says of E-stop and pilot pressure. @param last what it said before
std::optional<std::uint8_t> inputs_in(const CanFrame& frame, const BusDescription& bus, std::uint8_t last) {
  if (bus.has_enable()) return frame.id == bus.enable().tpdo_id() ? canopen::parse_enable(frame) : std::nullopt;
  std::optional<std::uint8_t> said;
  const auto take = [&](int index, std::uint8_t bit) {
    const auto [sent, field] = bus.broadcast(NodeRole::kEnable, index);
    if (sent == nullptr || !sent->filter().lets(frame.id) || !sent->is_in(frame)) return;
    const bool yes = read_raw(field->bits, frame) == field->on;
    const unsigned others = said.value_or(last) & ~unsigned{bit};
    said = static_cast<std::uint8_t>(others | (yes ? bit : 0U));
  };
  take(kEStopClosedIndex, canopen::kInputEStopClosed);
  take(kPilotOnIndex, canopen::kInputPilotOn);
  return said;
}

void note_enable(const CanSeen& can, const MachineDescription& machine, std::uint8_t& inputs, bool& any,
                 Evidence& evidence) {
  const auto now = inputs_in(can.frame, machine.bus, inputs);
  if (!now) return;
  const auto fell = [&](std::uint8_t bit) { return any && (inputs & bit) != 0 && (*now & bit) == 0; };
  if (fell(canopen::kInputEStopClosed)) evidence.e_stop_opened = can.at;
  if (fell(canopen::kInputPilotOn)) evidence.pilot_lost = can.at;
  inputs = *now;
  any = true;
}

/// A spool is apart where it is outside of all that it was told lately.
void note_valves(const Stop& stop, const Window& window, Evidence& evidence) {
  std::array<std::vector<std::pair<Time, double>>, kJoints> told;
  for (const slave::SlaveState& state : window.machine) {
    if (state.at > stop.at) break;
    for (int joint = 0; joint < kJoints; ++joint) {
      auto& lately = told[static_cast<std::size_t>(joint)];
      ValveSeen& valve = evidence.valves[static_cast<std::size_t>(joint)];
      const double spool = state.spool[joint];
      if (std::abs(spool - valve.spool) > kStill) valve.still_since = state.at;
      double low = state.valve_command[joint], high = low;
      for (const auto& [at, command] : lately) {
        low = std::min(low, command);
        high = std::max(high, command);
      }
      const double apart = std::max({0.0, low - spool, spool - high});
      if (apart <= kApart) {
        valve.apart_since.reset();
        valve.most_apart = 0;
      } else {
        if (!valve.apart_since) valve.apart_since = state.at;
        if (apart > valve.most_apart) {
          valve.most_apart = apart;
          valve.told = state.at == stop.at ? lately.back().second : state.valve_command[joint];
        }
      }
      if (valve.most_apart == 0) valve.told = state.valve_command[joint];
      valve.spool = spool;
      lately.emplace_back(state.at, state.valve_command[joint]);
      std::erase_if(lately, [&](const auto& old) { return to_seconds(state.at - old.first) > kLag_s; });
    }
  }
}

void note_bus(const Stop& stop, const Window& window, const MachineDescription& machine, Evidence& evidence) {
  // Every answer of the controller is recorded, also one like the last.
  for (const WireChange& change : window.changes) {
    if (change.kind != WireEventKind::kCanState || change.at > stop.at) continue;
    const CanState worse = evidence.can_states[evidence.can_bus], now = recording::can_state(change.value);
    const std::uint8_t of = recording::can_state_of(change.value);
    evidence.can_states = recording::can_states(change.value);
    evidence.both_told = recording::both_told(change.value);
    if (now == worse && of == evidence.can_bus) continue;
    evidence.can_bus = of;
    evidence.can_changed = now == CanState::kActive ? std::nullopt : std::optional(change.at);
    if (machine.bus.second) evidence.bus = "bus " + machine.bus.line(of).name;
  }
  const Time since = evidence.can_changed.value_or(stop.at);
  const auto is_its = [&](const CanSeen& can) {
    return !evidence.can_changed || ((can.frame.id & kSecondBus) != 0 ? 1 : 0) == evidence.can_bus;
  };
  Times received;
  std::uint8_t inputs = 0;
  bool any = false;
  const std::vector<CanFilter> packets = slave::packet_filters(machine.bus);
  const auto of_j1939 = [&](std::uint32_t id) {
    const bool claims = machine.bus.j1939_address && (j1939::is_of(j1939::kRequest, id & ~kSecondBus) ||
                                                      j1939::is_of(j1939::kAddressClaim, id & ~kSecondBus));
    return claims || slave::hears(packets, id);
  };
  for (const CanSeen& can : window.can) {
    if (can.kind == WireEventKind::kCanReceived) {
      if (is_its(can)) received.add(can.at);
      if (can.at <= stop.at) note_enable(can, machine, inputs, any, evidence);
      const std::uint8_t node = canopen::node_of(can.frame.id);
      const bool known = std::any_of(evidence.nodes.begin(), evidence.nodes.end(), [&](const NodeSeen& seen) {
        return seen.node.id == node || std::any_of(seen.pdos.begin(), seen.pdos.end(),
                                                   [&](const PdoSeen& pdo) { return pdo.id == can.frame.id; });
      });
      const auto& own = machine.bus.broadcasts;
      const bool broadcast = std::any_of(
          own.begin(), own.end(), [&](const BroadcastFrame& frame) { return frame.filter().lets(can.frame.id); });
      if (!broadcast && !of_j1939(can.frame.id) &&
          (!known || can.frame.id > kMostId || canopen::function_of(can.frame.id) == 0))
        ++evidence.foreign[can.frame.id];
    }
    if (can.at <= since || can.at > since + kAfterStop || !is_its(can)) continue;
    if (can.kind == WireEventKind::kCanReceived) ++evidence.can_received_after;
    if (can.kind == WireEventKind::kCanSent) ++evidence.can_sent_after;
    if (can.kind == WireEventKind::kCanRefused) ++evidence.can_refused_after;
  }
  evidence.can_received = received.around(stop.at, window.to);
}

void note_link(const Stop& stop, const Window& window, Evidence& evidence) {
  Times to_machine, from_machine, to_operator, from_operator;
  for (const LinkSeen& seen : window.machine_link) {
    if (seen.kind == WireEventKind::kLinkSent) from_machine.add(seen.at);
    if (seen.kind != WireEventKind::kLinkReceived) continue;
    if (seen.understood) to_machine.add(seen.at);
    if (seen.at <= stop.at) evidence.not_understood = seen.understood ? 0 : evidence.not_understood + 1;
  }
  for (const LinkSeen& seen : window.operator_link) {
    if (seen.kind == WireEventKind::kLinkSent) from_operator.add(seen.at);
    if (seen.kind == WireEventKind::kLinkReceived && seen.understood) to_operator.add(seen.at);
  }
  evidence.to_machine = to_machine.around(stop.at, window.to);
  evidence.from_machine = from_machine.around(stop.at, window.to);
  evidence.to_operator = to_operator.around(stop.at, window.to);
  evidence.from_operator = from_operator.around(stop.at, window.to);
}

void note_device(const Stop& stop, const Window& window, Evidence& evidence) {
  for (const WireChange& change : window.changes) {
    if (change.kind != WireEventKind::kHidConnected || change.at > stop.at) continue;
    evidence.unplugged = change.value == 0 ? std::optional(change.at) : std::nullopt;
  }
  Times sound;
  for (const HidSeen& seen : window.hid) {
    if (seen.kind != WireEventKind::kHidReceived) continue;
    if (seen.sound) sound.add(seen.at);
    if (seen.at > stop.at) continue;
    evidence.damaged_reports = seen.sound ? 0 : evidence.damaged_reports + 1;
    if (!seen.sound) evidence.zeros = seen.zeros;
  }
  evidence.reports = sound.around(stop.at, window.to);
}

/// The last one that began before the stop and was over or lasted at it. Steps that are missing in the recording, by
/// their numbers, are none.
std::optional<Pause> pause_of(const std::vector<StepMark>& steps, const Stop& stop, Time end, Duration patience) {
  std::optional<Pause> pause;
  for (std::size_t i = 0; i < steps.size() && steps[i].at <= stop.at; ++i) {
    const Time next = i + 1 < steps.size() ? steps[i + 1].at : end;
    const bool near = next >= stop.at - Evidence::kBefore;
    const bool lost = i + 1 < steps.size() && steps[i + 1].number != steps[i].number + 1;
    if (near && !lost && next - steps[i].at > patience) pause = Pause{steps[i].at, next};
  }
  return pause;
}

}  // namespace

std::optional<double> ChannelSeen::read(FrameField::Part part) const {
  const auto field =
      std::find_if(fields.begin(), fields.end(), [part](const FrameField& one) { return one.part == part; });
  return newest && field != fields.end() ? read_value(field->bits, *newest) : std::nullopt;
}

bool NodeSeen::sends_none() const {
  return std::all_of(pdos.begin(), pdos.end(), [](const PdoSeen& pdo) { return pdo.frames.silent(); });
}

bool NodeSeen::silent() const {
  const bool beats = heartbeat.next && !heartbeat.silent();
  return sends_none() && !beats;
}

Evidence evidence_of(const Stop& stop, const Window& window, const MachineDescription& machine) {
  Evidence evidence;
  for (const NodeDescription& node : machine.bus.nodes)
    evidence.nodes.push_back(node_seen(node, machine, stop, window, evidence));
  for (const BroadcastFrame& frame : machine.bus.broadcasts) {
    if (frame.module == 0 && !frame.on_request && !j1939::in_packets(frame.bytes))
      evidence.frames.push_back(frame_seen(frame, machine.bus, stop, window));
  }
  if (!machine.bus.by_frames()) note_valves(stop, window, evidence);  // else nobody tells where spools are
  note_bus(stop, window, machine, evidence);
  note_link(stop, window, evidence);
  note_device(stop, window, evidence);
  evidence.machine_pause = pause_of(window.machine_steps, stop, window.to, from_seconds(machine.bus.valve_watchdog_s));
  evidence.operator_pause = pause_of(window.operator_steps, stop, window.to, kOperatorPause);
  return evidence;
}

}  // namespace knuckle::explain
