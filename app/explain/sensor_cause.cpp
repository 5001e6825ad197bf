#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/explain/node_cause.h"
#include "app/explain/text.h"
#include "slave/sensors.h"

namespace knuckle::explain {
namespace {

constexpr Duration kFrozen = 90ms;     // a living sensor of a driven axis does not repeat itself for so long
constexpr Duration kLookBack = 500ms;  // and ahead, for a length that runs away
constexpr double kBar = 1e5;

std::string name_of(const NodeSeen& seen) {
  return fmt::format("{} (node 0x{:02X})", seen.node.name, seen.node.node.id);
}

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

Cause invalid_pressure(const NodeSeen& seen, const Stop& stop, const MachineDescription& machine) {
  const auto format = canopen::pressure_format(machine.bus.wire.pressure_float, machine.bus.wire.pressure_digits);
  const auto reading = seen.newest ? canopen::parse_pressure(*seen.newest, format) : std::nullopt;
  Cause cause{"sensor_broken", "", {}, {}, seen.same_since.value_or(stop.at)};
  if (reading && (reading->status & (canopen::kPressureInvalid | canopen::kPressureOverload)) != 0) {
    cause.text = fmt::format(
        "{} reports of itself that it is broken: its status says \"{}\" (0x{:02X}); replace it", name_of(seen),
        (reading->status & canopen::kPressureInvalid) != 0 ? "value not valid" : "overload", reading->status);
    cause.supports.emplace_back("the status byte beside its value says so; the node itself lives and sends in time");
  } else {
    cause.text = name_of(seen) + " sends a pressure that cannot be: check sensor and wiring";
    cause.supports.push_back(fmt::format("value {:.1f} bar; its range ends at {:.0f} bar",
                                         (reading ? reading->pressure_Pa : 0) / kBar,
                                         machine.sensors.pressure_range_Pa / kBar));
  }
  return cause;
}

/// How a length left its range, or jumped.
struct Flight {
  double from_m = 0, to_m = 0;  ///< Last length before, and that furthest away from it.
  double fastest_mps = 0;
  Time since{}, until{};
};
std::optional<Flight> flight_of(const NodeSeen& seen, const Stop& stop, const Window& window, double step_m) {
  std::optional<Flight> flight;
  double last_m = 0;
  Time last_at = kNever;
  for (const CanSeen& can : window.can) {
    if (can.at > stop.at + kLookBack) break;
    if (can.kind != WireEventKind::kCanReceived || can.frame.id != seen.node.node.tpdo_id()) continue;
    const auto reading = canopen::parse_encoder(can.frame, step_m);
    if (!reading || can.at < stop.at - kLookBack) continue;
    const double now_m = reading->position_m;
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
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(seen.node.joint)];
  const auto flight = flight_of(seen, stop, window, machine.sensors.encoder_step_m);
  const std::string range = fmt::format("its cylinder is {:.3f} to {:.3f} m long; the node lives and sends in time",
                                        cylinder.min_length_m, cylinder.max_length_m);
  if (!flight)
    return {"sensor_broken",
            name_of(seen) + " sends a length that cannot be: check sensor, mounting and wiring",
            {range},
            {},
            stop.at};
  const bool beyond = flight->to_m > cylinder.max_length_m || flight->to_m < cylinder.min_length_m;
  return {"encoder_wire",
          fmt::format("the wire of {} snapped{}: at {} its length ran away, faster than any cylinder moves{}",
                      name_of(seen), beyond ? "" : ", or its drum slipped", at_text(flight->since),
                      beyond ? ", to beyond the cylinder's end" : ""),
          {fmt::format("from {:.3f} m to {:.3f} m within {}, at up to {:.1f} m/s; a cylinder makes less than {:.1f}",
                       flight->from_m, flight->to_m, span_text(flight->until - flight->since + 5ms),
                       flight->fastest_mps, slave::kValidity.cylinder_mps),
           range},
          {},
          flight->since};
}

Cause frozen_length(const NodeSeen& seen, const Stop& stop, const Window& window, const MachineDescription& machine) {
  const int joint = seen.node.joint;
  const auto axis = static_cast<std::size_t>(joint);
  const Time since = *seen.same_since;
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
                  100 * spool.low, 100 * spool.high, span_text(seen.longest_same)));
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

Cause frozen_pressure(const NodeSeen& seen, const Stop& stop, const Window& window) {
  const auto axis = static_cast<std::size_t>(seen.node.joint);
  const bool rod = seen.node.name.find("_rod_") != std::string::npos;
  const Time since = *seen.same_since;
  const Range other =
      range_of(window, since, stop.at, [&](const auto& s) { return s.pressure_Pa[2 * axis + (rod ? 0 : 1)]; });
  const Range length = range_of(window, since, stop.at, [&](const auto& s) { return s.cylinder_m[seen.node.joint]; });
  return {"sensor_frozen",
          fmt::format("the pressure transmitter {} froze: it repeated the same value {} times, for {}, since {}",
                      name_of(seen), seen.same_times, span_text(stop.at - since), at_text(since)),
          {fmt::format("meanwhile the other chamber changed by {:.1f} bar and the cylinder moved by {:.0f} mm",
                       other.span() / kBar, 1e3 * length.span()),
           fmt::format("a living transmitter has noise: before, it repeated itself for {} at most",
                       span_text(seen.longest_same)),
           "the node lives and sends in time"},
          {},
          since};
}

}  // namespace

std::optional<Cause> sensor_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                  const MachineDescription& machine) {
  const bool invalid = stop.reason.code == ReasonCode::kSensorInvalid;
  if (!invalid && stop.reason.code != ReasonCode::kSensorImplausible) return std::nullopt;
  const auto found = std::find_if(evidence.nodes.begin(), evidence.nodes.end(),
                                  [&](const NodeSeen& seen) { return seen.node.node.id == stop.reason.subject; });
  if (found == evidence.nodes.end()) return std::nullopt;
  const NodeSeen& seen = *found;
  const bool encoder = seen.node.role == NodeRole::kEncoder, pressure = seen.node.role == NodeRole::kPressure;
  if (invalid && pressure) return invalid_pressure(seen, stop, machine);
  if (invalid && encoder) return invalid_length(seen, stop, window, machine);
  const bool frozen = seen.same_since && stop.at - *seen.same_since >= kFrozen;
  if (frozen && encoder) return frozen_length(seen, stop, window, machine);
  if (frozen && pressure) return frozen_pressure(seen, stop, window);
  return Cause{"sensor_contradicts",
               name_of(seen) + " contradicts the other sensors: " + text(stop.reason),
               {"it lives and sends changing values: neither silent nor frozen"},
               {"a leaking or worn valve, or exchanged hoses, contradict the sensors in the same way"},
               stop.at};
}

}  // namespace knuckle::explain
