// Causes at nodes of the bus: silent, rebooted, stuck; sensors that send what cannot be.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/explain/cause.h"
#include "app/explain/window.h"
#include "core/units.h"
#include "machine/bus_frames.h"
#include "machine/encoder_length.h"
#include "machine/reason_text.h"
#include "slave/plausibility.h"
#include "slave/sensors.h"
#include "transport/signal_codec.h"

namespace knuckle::explain {
namespace {

constexpr std::size_t kStorm = 20;  // emergencies of one node within two seconds that are no single event

std::string name_of(const NodeSeen& seen) {
  return node_text(seen.node);
}

std::string names_of(const std::vector<const NodeSeen*>& nodes) {
  std::string names;
  for (const NodeSeen* seen : nodes) names += (names.empty() ? "" : ", ") + name_of(*seen);
  return names;
}

std::vector<const NodeSeen*> those(const Evidence& evidence, auto condition) {
  std::vector<const NodeSeen*> found;
  for (const NodeSeen& seen : evidence.nodes)
    if (condition(seen)) found.push_back(&seen);
  return found;
}

/// The node that the stop's reason is about; null where it is about none.
const NodeSeen* meant_by(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  const NodeDescription* const node = node_of(stop.reason, machine.bus);
  if (node == nullptr) return nullptr;
  const auto nodes = those(evidence, [node](const NodeSeen& seen) { return seen.node.id == node->id; });
  return nodes.empty() ? nullptr : nodes.front();
}

Time first_silence(const std::vector<const NodeSeen*>& nodes) {
  Time first = *nodes.front()->data.last;
  for (const NodeSeen* seen : nodes) first = std::min(first, *seen->data.last);
  return first;
}

std::optional<Cause> other_node(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  if (stop.reason.code != ReasonCode::kNodeIdentity || !evidence.other_identity) return std::nullopt;
  const auto& answer = *evidence.other_identity;
  const char* what = answer.object == canopen::kDeviceType ? "device type"
                     : answer.object == canopen::kVendorId ? "vendor"
                                                           : "product code";
  return Cause{"other_node",
               fmt::format("{} is another device than the machine file names: its {} is 0x{:X}, and must be 0x{:X}; it "
                           "was exchanged, or the node number is set wrongly",
                           node_text(evidence.other_node, machine.bus), what, answer.value, evidence.expected_identity),
               {fmt::format("it answered so itself, when object 0x{:04X}:{:02d} was read at the start-up",
                            answer.object.index, answer.object.subindex)},
               {},
               stop.at};
}

std::optional<Cause> rebooted(const Evidence& evidence) {
  const auto nodes = those(evidence, [](const NodeSeen& seen) { return seen.booted.has_value(); });
  if (nodes.empty() || nodes.size() == evidence.nodes.size()) return std::nullopt;
  return Cause{
      "node_rebooted",
      names_of(nodes) + " started anew by itself at " + at_text(*nodes.front()->booted) +
          " and lost its configuration: check its power supply and connector",
      {"it sent its boot-up message, which nobody had asked for",
       fmt::format("the other {} nodes went on as usual: not the whole bus", evidence.nodes.size() - nodes.size())},
      {"a node that is off, or whose cable is off, would stay silent"},
      *nodes.front()->booted};
}

/// Of the node that the stop names: others may have left their working state because of the stop.
std::optional<Cause> stopped_working(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  if (stop.reason.code != ReasonCode::kSensorStale && stop.reason.code != ReasonCode::kNodeFault) return std::nullopt;
  const NodeSeen* const named = meant_by(stop, evidence, machine);
  if (named == nullptr || !named->left || !named->emergencies.empty()) return std::nullopt;
  const NodeSeen& first = *named;
  const auto nodes = those(evidence, [](const NodeSeen& seen) { return seen.left.has_value(); });
  const bool all = nodes.size() == evidence.nodes.size();
  return Cause{
      "node_not_operational",
      fmt::format("{} said at {} to be {}: set so from outside, by a service tool or another controller, or gone there "
                  "by itself after an error: see its manual",
                  all ? "all nodes" : names_of(nodes), at_text(*first.left),
                  first.left_to == canopen::NmtState::kStopped ? "stopped" : "pre-operational"),
      {"its heartbeat says so, and goes on: power and cable are sound",
       fmt::format("in that state a node sends no process data; the last came at {}",
                   first.data.last ? at_text(*first.data.last) : "no known time")},
      {"a node that started anew would have said so first"},
      *first.left};
}

std::optional<Cause> too_short(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  if (stop.reason.code != ReasonCode::kFrameShort) return std::nullopt;
  const NodeSeen* const node = meant_by(stop, evidence, machine);
  if (node == nullptr) return std::nullopt;
  Cause cause{"frame_short",
              fmt::format("{} sent process data of {:.0f} bytes, of which {:.0f} are mapped: its mapping was changed "
                          "behind the start-up, or its firmware does not keep to it",
                          name_of(*node), stop.reason.value, stop.reason.limit),
              {},
              {},
              stop.at};
  if (!node->data.silent()) cause.supports.emplace_back("its frames go on in time: power, cable and SYNC are sound");
  return cause;
}

Cause one_silent(const std::vector<const NodeSeen*>& nodes, const Evidence& evidence) {
  const NodeSeen& seen = *nodes.front();
  Cause cause{"node_silent",
              fmt::format("{} sent no frame since {}; all others did: node dead, its power or its cable off",
                          names_of(nodes), at_text(first_silence(nodes))),
              {},
              {},
              first_silence(nodes)};
  cause.supports.push_back(fmt::format("process data, usual every {}, came last at {}", span_text(seen.data.usual),
                                       at_text(*seen.data.last)));
  if (seen.heartbeat.silent())
    cause.supports.push_back("its heartbeat, due every " + span_text(seen.heartbeat.usual) + ", came last at " +
                             at_text(*seen.heartbeat.last) + " and was missing as well");
  cause.supports.push_back(
      fmt::format("the other {} nodes went on as usual: SYNC and bus are sound", evidence.nodes.size() - nodes.size()));
  cause.against.emplace_back(
      "it reported no emergency and did not start anew, so a dead node and a broken cable to it "
      "look the same");
  return cause;
}

/// "process data"; of a node that goes on with others "TPDO2, TPDO3".
std::string missing_of(const std::vector<const NodeSeen*>& quiet) {
  if (quiet.size() > 1 || quiet.front()->sends_none()) return "process data";
  std::string names;
  for (const PdoSeen& pdo : quiet.front()->pdos)
    if (pdo.frames.silent()) names += (names.empty() ? "" : ", ") + pdo.name;
  return names;
}

std::optional<Cause> silent(const Evidence& evidence) {
  const auto quiet = those(evidence, [](const NodeSeen& seen) { return seen.data.silent(); });
  if (quiet.empty()) return std::nullopt;
  const auto gone = those(evidence, [](const NodeSeen& seen) { return seen.silent(); });
  const std::size_t all = evidence.nodes.size();
  if (gone.size() == all)
    return Cause{"bus_cut",
                 "all nodes fell silent at once, at " + at_text(first_silence(gone)) +
                     ": the bus is cut between controller and nodes, or all nodes lost power",
                 {"neither process data nor heartbeats came from any of them"},
                 {"a missing SYNC would leave the heartbeats"},
                 first_silence(gone)};
  const auto beating = quiet.size() - gone.size();
  // The enable node does not wait for SYNC.
  if (gone.empty() && beating + 1 >= all)
    return Cause{"sync_missing",
                 "SYNC does not reach the nodes since " + at_text(first_silence(quiet)) +
                     ": all that is sent on SYNC stopped at once, and what is not goes on",
                 {fmt::format("{} of {} nodes sent no process data, but all their heartbeats went on", beating, all),
                  "enable node and heartbeats need no SYNC: bus and power are sound"},
                 {"a cut bus would have silenced the heartbeats as well"},
                 first_silence(quiet)};
  if (!gone.empty()) return one_silent(gone, evidence);
  return Cause{"process_data_missing",
               names_of(quiet) + " sent no " + missing_of(quiet) + " since " + at_text(first_silence(quiet)) +
                   ", although it lives: its heartbeat went on",
               {"no emergency came from it, and the others went on as usual"},
               {"cable and power are sound: look at the node's configuration"},
               first_silence(quiet)};
}

std::optional<Cause> stuck_valve(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  const auto apart = [](const ValveSeen& valve) { return valve.apart_since ? valve.most_apart : 0; };
  const auto worst = std::max_element(evidence.valves.begin(), evidence.valves.end(),
                                      [&](const auto& a, const auto& b) { return apart(a) < apart(b); });
  if (!worst->apart_since) return std::nullopt;
  const auto joint = static_cast<std::size_t>(worst - evidence.valves.begin());
  const std::uint8_t id = machine.bus.valve(joint).id;
  const NodeSeen& node = *those(evidence, [id](const NodeSeen& seen) { return seen.node.id == id; }).at(0);
  Cause cause{
      "valve_stuck",
      fmt::format("the valve of the {} has not followed since {}: its spool stayed at {:.0f} % while it was told "
                  "{:.0f} %: spool stuck, or its solenoid or driver failed",
                  kJointNames[joint], at_text(*worst->apart_since), 100 * worst->spool, 100 * worst->told),
      {},
      {},
      *worst->apart_since};
  if (worst->still_since < *worst->apart_since)
    cause.supports.push_back("its spool was reported at the same place ever since " + at_text(worst->still_since));
  cause.supports.push_back(
      fmt::format("up to {:.0f} % of stroke beyond all that it was told in the 100 ms before; "
                  "the spools of the others followed",
                  100 * worst->most_apart));
  if (!node.silent() && node.emergencies.empty())
    cause.supports.push_back(name_of(node) + ": heartbeat and process data normal, no emergency of its own");
  const auto watch = those(evidence, [&](const NodeSeen& seen) {
    return seen.node.id == machine.bus.enable().id && !seen.emergencies.empty();
  });
  if (!watch.empty() && stop.reason.code != ReasonCode::kValveNotFollowing)
    cause.supports.push_back(name_of(*watch.front()) +
                             ", which watches the valves on the bus, reported an emergency for it: it is the witness, "
                             "not the cause");
  cause.against.emplace_back("a position sensor of the spool that stands still looks the same: did the cylinder move?");
  return cause;
}

std::optional<Cause> emergency(const Evidence& evidence) {
  const auto nodes = those(evidence, [](const NodeSeen& seen) { return !seen.emergencies.empty(); });
  if (nodes.empty()) return std::nullopt;
  const NodeSeen& first = **std::min_element(nodes.begin(), nodes.end(), [](const NodeSeen* a, const NodeSeen* b) {
    return a->emergencies.front().at < b->emergencies.front().at;
  });
  const EmergencySeen& seen = first.emergencies.front();
  const std::string what =
      fmt::format("0x{:04X}, {}", seen.emergency.code, canopen::emergency_text(seen.emergency.code));
  const std::string others = fmt::format("{} more node{} reported one", nodes.size() - 1, nodes.size() == 2 ? "" : "s");
  if (first.emergencies.size() >= kStorm) {
    const Duration span = first.emergencies.back().at - seen.at;
    Cause cause{
        "emergency_storm",
        fmt::format("{} floods the bus with emergencies ({}) since {}: {} in {}; the node is faulty: replace it, "
                    "see its manual",
                    name_of(first), what, at_text(seen.at), first.emergencies.size(), span_text(span)),
        {fmt::format("one about every {:.1f} ms; one that means an event is sent once",
                     1e3 * to_seconds(span) / static_cast<double>(first.emergencies.size()))},
        {},
        seen.at};
    if (!first.data.silent()) cause.supports.emplace_back("its process data and heartbeat went on as usual");
    return cause;
  }
  Cause cause{"node_emergency",
              fmt::format("{} reported an emergency at {}: {}; see its manual", name_of(first), at_text(seen.at), what),
              {fmt::format("{} emergency message{} of it, the first sign of anything", first.emergencies.size(),
                           first.emergencies.size() == 1 ? "" : "s")},
              {},
              seen.at};
  if (!first.data.silent())
    cause.supports.emplace_back(
        "its process data and heartbeat went on as usual, and the spools followed: the node "
        "itself says what is wrong with it");
  if (nodes.size() > 1) cause.supports.push_back(others + ", later");
  return cause;
}

}  // namespace

std::optional<Cause> node_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                const MachineDescription& machine) {
  if (auto cause = other_node(stop, evidence, machine)) return cause;
  if (auto cause = rebooted(evidence)) return cause;
  if (auto cause = too_short(stop, evidence, machine)) return cause;
  if (auto cause = stopped_working(stop, evidence, machine)) return cause;
  if (auto cause = silent(evidence)) return cause;
  if (auto cause = sensor_cause(stop, window, evidence, machine)) return cause;
  if (auto cause = stuck_valve(stop, evidence, machine)) return cause;
  return emergency(evidence);
}

namespace {

constexpr Duration kFrozen = 90ms;     // a living sensor of a driven axis does not repeat itself for so long
constexpr Duration kLookBack = 500ms;  // and ahead, for a length that runs away

/// Lowest and highest of a value between two times.
struct Range {
  double low = 0, high = 0;
  [[nodiscard]] double span() const { return high - low; }
};
Range range_of(const Window& window, Time from, Time to, auto value) {
  Range range;
  bool any = false;
  for (const slave::SlaveState& state : window.machine) {
    if (state.at < from || state.at > to) continue;
    const double now = value(state);
    range = any ? Range{std::min(range.low, now), std::max(range.high, now)} : Range{now, now};
    any = true;
  }
  return range;
}

bool says_broken(const ChannelSeen& channel) {
  const auto status = static_cast<unsigned>(channel.read(FrameField::Part::kStatus).value_or(0));
  return (status & (canopen::kPressureInvalid | canopen::kPressureOverload)) != 0;
}

/// The channel whose signal the stop's reason names; of a node with one channel that one. Null where it names none.
const ChannelSeen* channel_of(const NodeSeen& seen, const Stop& stop) {
  if (seen.channels.size() == 1) return &seen.channels.front();
  const auto signal = signal_of(stop.reason);
  const auto found = std::find_if(seen.channels.begin(), seen.channels.end(), [&](const ChannelSeen& channel) {
    return signal == std::size_t{channel.channel.signal};
  });
  return found == seen.channels.end() ? nullptr : &*found;
}

/// The channel that the loop refuses, where the stop's reason names none. Null where there is none.
const ChannelSeen* bad_pressure(const NodeSeen& seen, double range_Pa) {
  const auto bad = [range_Pa](const ChannelSeen& channel) {
    const auto pressure_Pa = channel.read(FrameField::Part::kValue);
    const bool possible = pressure_Pa >= slave::kValidity.pressure_floor_Pa &&
                          pressure_Pa <= slave::kValidity.pressure_over_range * range_Pa;
    return pressure_Pa && (says_broken(channel) || !possible);
  };
  const auto found = std::find_if(seen.channels.begin(), seen.channels.end(), bad);
  return found == seen.channels.end() ? nullptr : &*found;
}

/// Of several channels with that one's.
std::string name_of(const NodeSeen& seen, const ChannelSeen& channel) {
  return name_of(seen) + (seen.channels.size() > 1 ? fmt::format(", {},", channel.channel.info().name) : "");
}

Cause invalid_pressure(const NodeSeen& seen, const Stop& stop, const MachineDescription& machine) {
  const double range_bar = machine.sensors.pressure_range_Pa / kBar;
  const ChannelSeen* const named = channel_of(seen, stop);
  const ChannelSeen* const channel = named ? named : bad_pressure(seen, machine.sensors.pressure_range_Pa);
  if (channel == nullptr)
    return {"sensor_broken",
            name_of(seen) + " sent a pressure that cannot be: check its sensors and their wiring",
            {fmt::format("no channel of it has one at the stop; their range ends at {:.0f} bar", range_bar)},
            {},
            stop.at};
  Cause cause{"sensor_broken", "", {}, {}, channel->same_since.value_or(stop.at)};
  const std::string name = name_of(seen, *channel);
  if (says_broken(*channel)) {
    const auto status = static_cast<unsigned>(channel->read(FrameField::Part::kStatus).value_or(0));
    cause.text = fmt::format("{} reports of itself that it is broken: its status says \"{}\" (0x{:02X}); replace it",
                             name, (status & canopen::kPressureInvalid) != 0 ? "value not valid" : "overload", status);
    cause.supports.emplace_back("the status byte beside its value says so; the node itself lives and sends in time");
  } else {
    cause.text = name + " sends a pressure that cannot be: check sensor and wiring";
    cause.supports.push_back(fmt::format("value {:.1f} bar; its range ends at {:.0f} bar",
                                         channel->read(FrameField::Part::kValue).value_or(0) / kBar, range_bar));
  }
  return cause;
}

/// How a length left its range, or jumped.
struct Flight {
  double from_m = 0, to_m = 0;  ///< Last length before, and that furthest away from it.
  double fastest_mps = 0;
  Time since{}, until{};
};
std::optional<Flight> flight_of(const NodeSeen& seen, const Stop& stop, const Window& window,
                                const MachineDescription& machine) {
  const EncoderLengths lengths(machine);
  const std::vector<FrameField> fields = sent_fields(seen.node, machine);
  const FrameField* const field = find_field(fields, FrameField::Part::kValue, seen.node.channels.front());
  std::optional<Flight> flight;
  double last_m = 0;
  Time last_at = kNever;
  for (const CanSeen& can : window.can) {
    if (can.at > stop.at + kLookBack) break;
    if (can.kind != WireEventKind::kCanReceived || can.frame.id != seen.channels.front().id) continue;
    const auto reading = read_value(field->bits, can.frame);
    const auto length_m = reading ? lengths.length_m(seen.node.joint(), *reading) : std::nullopt;
    if (!length_m || can.at < stop.at - kLookBack) continue;
    const double now_m = *length_m;
    if (last_at != kNever && can.at > last_at) {
      const double speed_mps = std::abs(now_m - last_m) / to_seconds(can.at - last_at);
      if (!flight && speed_mps > slave::kValidity.cylinder_mps) flight = Flight{last_m, last_m, 0, can.at, can.at};
      if (flight) flight->fastest_mps = std::max(flight->fastest_mps, speed_mps);
      if (flight && std::abs(now_m - flight->from_m) > std::abs(flight->to_m - flight->from_m)) {
        flight->to_m = now_m;
        flight->until = can.at;
      }
    }
    last_m = now_m;
    last_at = can.at;
  }
  return flight;
}

Cause invalid_length(const NodeSeen& seen, const Stop& stop, const Window& window, const MachineDescription& machine) {
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(seen.node.joint())];
  const auto flight = flight_of(seen, stop, window, machine);
  const std::string range = fmt::format("its cylinder is {:.3f} to {:.3f} m long; the node lives and sends in time",
                                        cylinder.min_length_m, cylinder.max_length_m);
  if (!flight)
    return {"sensor_broken",
            name_of(seen) + (seen.node.measures_angle() ? " sends an angle" : " sends a length") +
                " that cannot be: check sensor, mounting and wiring",
            {range},
            {},
            stop.at};
  const bool beyond = flight->to_m > cylinder.max_length_m || flight->to_m < cylinder.min_length_m;
  const bool angle = seen.node.measures_angle();
  const char* const slipped = angle ? ", or slipped" : ", or its drum slipped";
  return {"encoder_wire",
          fmt::format("the {} of {} {}{}: at {} its length ran away, faster than any cylinder moves{}",
                      angle ? "coupling" : "wire", name_of(seen), angle ? "broke" : "snapped", beyond ? "" : slipped,
                      at_text(flight->since), beyond ? ", to beyond the cylinder's end" : ""),
          {fmt::format("from {:.3f} m to {:.3f} m within {}, at up to {:.1f} m/s; a cylinder makes less than {:.1f}",
                       flight->from_m, flight->to_m, span_text(flight->until - flight->since + 5ms),
                       flight->fastest_mps, slave::kValidity.cylinder_mps),
           range},
          {},
          flight->since};
}

Cause frozen_length(const NodeSeen& seen, const Stop& stop, const Window& window, const MachineDescription& machine) {
  const int joint = seen.node.joint();
  const auto axis = static_cast<std::size_t>(joint);
  const ChannelSeen& channel = seen.channels.front();
  const Time since = *channel.same_since;
  const Range spool = range_of(window, since, stop.at, [&](const auto& state) { return state.spool[joint]; });
  Range driven[2];
  for (std::size_t side = 0; side < 2; ++side)
    driven[side] = range_of(window, since, stop.at, [&](const auto& s) { return s.pressure_Pa[2 * axis + side]; });
  Cause cause{"sensor_frozen",
              fmt::format("the encoder of the {} froze: {} sent the same value for {}, since {}, while the valve drove "
                          "its cylinder",
                          kJointNames[axis], name_of(seen), span_text(stop.at - since), at_text(since)),
              {},
              {},
              since};
  cause.supports.push_back(
      fmt::format("its spool was between {:.0f} and {:.0f} % meanwhile; before, its value stood "
                  "still for {} at most",
                  100 * spool.low, 100 * spool.high, span_text(channel.longest_same)));
  cause.supports.push_back(
      fmt::format("its pressures went on changing: head side {:.0f} to {:.0f} bar, rod side {:.0f} to {:.0f} bar",
                  driven[0].low / kBar, driven[0].high / kBar, driven[1].low / kBar, driven[1].high / kBar));
  const double highest = std::max(driven[0].high, driven[1].high);
  const double relief = machine.hydraulics.main_relief_Pa;
  cause.against.push_back(
      fmt::format("a cylinder that is blocked also stands still, but would drive its chamber towards "
                  "the relief ({:.0f} bar): the highest was {:.0f} bar{}",
                  relief / kBar, highest / kBar, highest > 0.6 * relief ? ", so this cannot be excluded" : ""));
  return cause;
}

bool stands(const ChannelSeen& channel, const Stop& stop) {
  return channel.same_since && stop.at - *channel.same_since >= kFrozen;
}

/// What the rest of its axis did while a pressure stood.
struct Meanwhile {
  Range other_Pa, cylinder_m;
};
Meanwhile meanwhile(const ChannelSeen& channel, const Stop& stop, const Window& window) {
  const int index = channel.channel.info().index;
  const Time since = *channel.same_since;
  const auto other = static_cast<std::size_t>(index) ^ 1U;
  return {range_of(window, since, stop.at, [&](const auto& s) { return s.pressure_Pa[other]; }),
          range_of(window, since, stop.at, [&](const auto& s) { return s.cylinder_m[index / 2]; })};
}

/// Of those that stand the one that the loop means: the one it names; else where a chamber does not really stand at one
/// value, and whose axis did most meanwhile. Null where none stands.
const ChannelSeen* frozen_of(const NodeSeen& seen, const Stop& stop, const Window& window) {
  if (const ChannelSeen* named = channel_of(seen, stop)) return stands(*named, stop) ? named : nullptr;
  const auto suspect = [&](const ChannelSeen& channel) {
    if (!stands(channel, stop)) return -1.0;
    if (channel.read(FrameField::Part::kValue) < slave::kPlausibility.cavitating_Pa) return 0.0;
    const Meanwhile did = meanwhile(channel, stop, window);
    return std::max(did.other_Pa.span() / slave::kPlausibility.other_side_Pa,
                    did.cylinder_m.span() / slave::kPlausibility.repeat_travel_m);
  };
  const auto most = std::max_element(seen.channels.begin(), seen.channels.end(),
                                     [&](const auto& a, const auto& b) { return suspect(a) < suspect(b); });
  return most != seen.channels.end() && stands(*most, stop) ? &*most : nullptr;
}

Cause frozen_pressure(const NodeSeen& seen, const ChannelSeen& channel, const Stop& stop, const Window& window) {
  const Time since = *channel.same_since;
  const Meanwhile did = meanwhile(channel, stop, window);
  return {"sensor_frozen",
          fmt::format("the pressure transmitter {} froze: it repeated the same value {} times, for {}, since {}",
                      name_of(seen, channel), channel.same_times, span_text(stop.at - since), at_text(since)),
          {fmt::format("meanwhile the other chamber changed by {:.1f} bar and the cylinder moved by {:.0f} mm",
                       did.other_Pa.span() / kBar, 1e3 * did.cylinder_m.span()),
           fmt::format("a living transmitter has noise: before, it repeated itself for {} at most",
                       span_text(channel.longest_same)),
           "the node lives and sends in time"},
          {},
          since};
}

}  // namespace

std::optional<Cause> sensor_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                  const MachineDescription& machine) {
  const bool invalid = stop.reason.code == ReasonCode::kSensorInvalid;
  if (!invalid && stop.reason.code != ReasonCode::kSensorImplausible) return std::nullopt;
  const NodeSeen* const found = meant_by(stop, evidence, machine);
  if (found == nullptr) return std::nullopt;
  const NodeSeen& seen = *found;
  if (seen.node.role == NodeRole::kModule) return std::nullopt;  // its reason says what is known of a sensor on it
  const bool encoder = seen.node.role == NodeRole::kEncoder, pressure = seen.node.role == NodeRole::kPressure;
  if (invalid && pressure) return invalid_pressure(seen, stop, machine);
  if (invalid && encoder) return invalid_length(seen, stop, window, machine);
  if (encoder && stands(seen.channels.front(), stop)) return frozen_length(seen, stop, window, machine);
  if (pressure)
    if (const ChannelSeen* frozen = frozen_of(seen, stop, window)) return frozen_pressure(seen, *frozen, stop, window);
  return Cause{"sensor_contradicts",
               text(stop.reason, machine.bus),
               {"it lives and sends changing values: neither silent nor frozen"},
               {"a leaking or worn valve, or exchanged hoses, contradict the sensors in the same way"},
               stop.at};
}

}  // namespace knuckle::explain
