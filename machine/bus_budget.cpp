#include "machine/bus_budget.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/units.h"
#include "machine/bus_frames.h"
#include "machine/toml_reader.h"
#include "transport/canopen.h"
#include "transport/j1939.h"

namespace knuckle {
namespace {

/// The bus with something changed, and what that is in the file's words.
struct Change {
  std::string text;
  BusDescription bus;
};

class Budget {
 public:
  Budget(const SensorDescription& sensors, double others_bits_per_s)
      : sensors_(sensors), others_bits_per_s_(others_bits_per_s) {}

  [[nodiscard]] double load(const BusDescription& bus) const {
    return worst_bus_load(bus) + others_bits_per_s_ / bus.bit_rate;
  }
  [[nodiscard]] bool fits(const Change& change) const { return is_within_fullest(load(change.bus)); }

  [[nodiscard]] std::optional<Change> fewer_valve_states(Change change) const {
    constexpr int kMostNth = 8;
    for (int& nth = change.bus.valve_status_every_nth_sync; ++nth <= kMostNth;)
      if (fits(change)) return added(change, fmt::format("valve_status_every_nth_sync = {}", nth));
    return std::nullopt;
  }

  /// Two values in place of one in a frame of a transmitter with several channels, else shorter frames. Nothing where
  /// one maps its values by itself.
  [[nodiscard]] std::optional<Change> short_pressures(Change change) const {
    using Pressure = WireDescription::Pressure;
    WireDescription& wire = change.bus.wire;
    const bool fixed = std::any_of(change.bus.nodes.begin(), change.bus.nodes.end(), [](const NodeDescription& node) {
      return node.role == NodeRole::kPressure && !node.tpdo_maps.empty();
    });
    if (fixed || wire.pressure == Pressure::kInteger16) return std::nullopt;
    wire.pressure = Pressure::kInteger16;
    const double highest_Pa = kOverRange * sensors_.pressure_range_Pa;
    while (wire.pressure_digits > 0 && std::numeric_limits<std::int16_t>::max() * wire.pressure_unit_Pa() <= highest_Pa)
      --wire.pressure_digits;
    return added(change, fmt::format("wire.pressure_value = \"integer16\" with wire.pressure_digits = {}",
                                     wire.pressure_digits));
  }

  /// The highest rate that fits, of those that a person would write.
  [[nodiscard]] std::optional<Change> slower(const Change& change) const {
    for (const int sync_Hz : {200, 125, 100, 50}) {
      Change slow = change;
      slow.bus.sync_Hz = sync_Hz;
      // A module's frames follow SYNC; what the machine's own controller is told must not come between two steps.
      for (BroadcastFrame& frame : slow.bus.broadcasts)
        if (frame.module != 0) frame.period_s = 1.0 / sync_Hz;
      bool too_slow = false;
      for (CommandFrame& frame : slow.bus.commands) {
        if (frame.module != 0) frame.period_s = slow.bus.set_point_every_nth_sync / slow.bus.sync_Hz;
        too_slow = too_slow || frame.period_s * sync_Hz < 1 - 1e-9 ||
                   (moves_joint(frame) && frame.period_s > kSlowestJoint_s * (1 + 1e-9));
      }
      if (sync_Hz >= change.bus.sync_Hz || too_slow || !fits(slow)) continue;
      slow = added(slow, fmt::format("sync_Hz = {}", sync_Hz));
      const double period_s = 1.0 / sync_Hz;
      return raised(raised(slow, "sensor_age_limit_ms", change.bus.sensor_age_limit_s,
                           2 * period_s * change.bus.tilt_every_nth_sync),
                    "valve_watchdog_ms", change.bus.valve_watchdog_s,
                    2 * period_s * change.bus.set_point_every_nth_sync);
    }
    return std::nullopt;
  }

  /// A module's inputs go out by fours: on its first channels they fill the fewest frames.
  [[nodiscard]] std::optional<Change> inputs_together(Change change) const {
    bool any = false;
    for (const NodeDescription& node : change.bus.nodes) {
      std::vector<BroadcastFrame*> frames;
      std::size_t inputs = 0;
      for (BroadcastFrame& frame : change.bus.broadcasts) {
        if (frame.module != node.id) continue;
        frames.push_back(&frame);
        inputs += frame.fields.size();
      }
      const std::size_t needed = (inputs + kAnalogsPerFrame - 1) / kAnalogsPerFrame;
      if (frames.size() <= needed) continue;
      any = true;
      for (std::size_t i = 0; i < needed; ++i)
        frames[i]->bytes = static_cast<std::uint8_t>(
            kAnalogBits / 8 * std::min<std::size_t>(kAnalogsPerFrame, inputs - i * kAnalogsPerFrame));
      for (std::size_t i = needed; i < frames.size(); ++i) frames[i]->bytes = 0;  // none
      change = added(change, fmt::format("the inputs of '{}' on its channels 1 to {}", node.name, inputs));
    }
    std::erase_if(change.bus.broadcasts, [](const BroadcastFrame& frame) { return frame.bytes == 0; });
    return any ? std::optional(change) : std::nullopt;
  }

  [[nodiscard]] std::optional<Change> faster_wire(const Change& change) const {
    for (const int kbps : kBitRates_kbps) {
      const auto bit_rate = static_cast<std::uint32_t>(1000 * kbps);
      if (bit_rate <= change.bus.bit_rate) continue;
      Change fast = change;
      fast.bus.bit_rate = bit_rate;
      if (fits(fast)) return added(fast, fmt::format("bit_rate_kbps = {}", kbps));
    }
    return std::nullopt;
  }

  [[nodiscard]] std::string text(const Change& change) const {
    return fmt::format("{} ({} %)", change.text, number_text(std::round(1000 * load(change.bus)) / 10));
  }

 private:
  static Change added(Change change, const std::string& text) {
    const bool joined = change.text.find(" with ") != std::string::npos;
    change.text += (change.text.empty() ? "" : joined ? " and " : " with ") + text;
    return change;
  }
  /// A limit that the file must have with it; nothing where none is long enough.
  static std::optional<Change> raised(const std::optional<Change>& change, const char* key, double is_s,
                                      double least_s) {
    if (!change || least_s > kLongestBlind_ms * kMilli * (1 + 1e-9)) return std::nullopt;
    if (is_s >= least_s * (1 - 1e-9)) return change;
    return added(*change, fmt::format("{} = {}", key, number_text(least_s / kMilli)));
  }

  const SensorDescription& sensors_;
  double others_bits_per_s_;
};

}  // namespace

std::vector<PeriodicFrame> bus_map(const BusDescription& bus) {
  std::vector<PeriodicFrame> map;
  const bool nodes = !bus.without_nodes();
  if (nodes) map.push_back({canopen::kSyncId, 0, bus.sync_Hz});
  for (const BusFrame& frame : bus_frames(bus)) map.push_back({frame.id, frame.bytes(), frame.rate_Hz(bus.sync_Hz)});
  if (nodes) map.push_back({canopen::heartbeat_id(bus.controller_id), 1, 1 / bus.controller_heartbeat_s});
  for (const NodeDescription& node : bus.nodes)
    map.push_back({canopen::heartbeat_id(node.id), 1, 1 / bus.node_heartbeat_s});
  for (const BroadcastFrame& frame : bus.broadcasts) {
    if (j1939::in_packets(frame.bytes)) {
      const auto part = [&](std::uint32_t group, unsigned times) {
        const std::uint32_t id = j1939::identifier(group, j1939::source_of(frame.id)) | (frame.id & kSecondBus);
        map.push_back({id, sizeof(CanFrame::data), times / frame.period_s});
      };
      part(j1939::kConnection, 1);
      part(j1939::kTransfer, j1939::packets_of(frame.bytes));
      continue;
    }
    const auto known =
        std::find_if(map.begin(), map.end(), [&](const PeriodicFrame& other) { return other.id == frame.id; });
    if (known == map.end())
      map.push_back({frame.id, frame.bytes, 1 / frame.period_s});
    else  // a multiplexer tells them apart
      known->rate_Hz += 1 / frame.period_s;
  }
  for (const CommandFrame& frame : bus.commands) map.push_back({frame.id, frame.bytes, 1 / frame.period_s});
  return map;
}

double worst_bus_load(const BusDescription& bus) {
  double bits_per_s = 0;
  for (const PeriodicFrame& frame : bus_map(bus)) bits_per_s += frame.rate_Hz * worst_case_bits(frame.size, frame.id);
  return bits_per_s / bus.bit_rate;
}

std::array<double, 2> worst_bus_loads(const BusDescription& bus) {
  return {worst_bus_load(bus.alone(0)), bus.second ? worst_bus_load(bus.alone(1)) : 0};
}

std::string what_fits(const BusDescription& bus, const SensorDescription& sensors, double others_bits_per_s) {
  const Budget budget(sensors, others_bits_per_s);
  const Change as_it_is{"", bus};
  const std::optional<Change> shorter = budget.short_pressures(as_it_is), slower = budget.slower(as_it_is);
  std::vector<std::string> all;
  const auto offer = [&](const std::optional<Change>& change) {
    if (change && budget.fits(*change)) all.push_back(budget.text(*change));
  };
  offer(budget.fewer_valve_states(as_it_is));
  offer(budget.inputs_together(as_it_is));
  offer(shorter);
  offer(slower);
  if (const auto both = shorter && !budget.fits(*shorter) ? budget.slower(*shorter) : std::nullopt;
      both && (!slower || both->bus.sync_Hz > slower->bus.sync_Hz))
    offer(both);
  offer(budget.faster_wire(as_it_is));
  return all.empty() ? "" : fmt::format("would fit: {}", fmt::join(all, ", or "));
}

}  // namespace knuckle
