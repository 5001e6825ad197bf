#include "machine/load_bus_lines.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "machine/bus_budget.h"
#include "machine/load_frames.h"

namespace knuckle {
namespace {

constexpr std::size_t kMostBuses = 2;

std::string read_name(TomlTable& file, const std::string& other) {
  constexpr std::size_t kLongest = 15;  // as of the interfaces that stand beside it in options
  const std::string name = file.text("name");
  file.require(is_plain_name(name, kLongest), "name", "must be a letter and up to 14 letters, digits and _");
  file.require(name != other, "name", "is the name of the other bus");
  return name;
}

/// @param needs_name of two @param other the name of the bus before it
BusLine read_line(TomlTable& file, bool needs_name, const std::string& other) {
  BusLine line;
  if (needs_name || file.has("name")) line.name = read_name(file, other);
  const std::int64_t kbps = file.integer("bit_rate_kbps");
  const auto rate = std::find(kBitRates_kbps.begin(), kBitRates_kbps.end(), kbps);
  file.require(rate != kBitRates_kbps.end(), "bit_rate_kbps",
               fmt::format("must be one of CANopen's: {}", fmt::join(kBitRates_kbps, ", ")));
  line.bit_rate = 1000 * static_cast<std::uint32_t>(rate != kBitRates_kbps.end() ? *rate : kBitRates_kbps.back());
  if (file.has("foreign_load_percent"))
    line.foreign_load = file.number("foreign_load_percent", 0, 100 * kFullestBus, 0.01);
  return line;
}

}  // namespace

std::vector<TomlTable> bus_tables(TomlTable& machine) {
  if (!machine.is_array("bus")) return {machine.table("bus")};
  std::vector<TomlTable> files = machine.tables("bus");
  machine.require(files.size() <= kMostBuses, "bus", "must be two at most");
  for (std::size_t i = kMostBuses; i < files.size(); ++i) files[i].leave_rest();
  if (files.empty()) files.push_back(machine.table("bus"));
  return files;
}

void read_bus_lines(std::vector<TomlTable>& files, BusDescription& bus) {
  const BusLine first = read_line(files[0], files.size() > 1, "");
  bus.name = first.name;
  bus.bit_rate = first.bit_rate;
  bus.foreign_load = first.foreign_load;
  if (files.size() == 1) return;
  TomlTable& file = files[1];
  bus.second = read_line(file, true, bus.name);
  for (const char* key : {"node", "nodes"}) {
    file.leave(key);
    file.require(!file.has(key), key, "must be of the first [[bus]]: all nodes are on one");
  }
  file.require(file.has("broadcast") || file.has("command"), "", "must have a [[bus.broadcast]] or a [[bus.command]]");
}

void check_bus_load(const TomlTable& file, const BusDescription& bus, const SensorDescription& sensors) {
  const double load = worst_bus_load(bus) + bus.foreign_load;
  if (is_within_fullest(load)) return;
  const std::string fits = what_fits(bus, sensors, bus.foreign_load * bus.bit_rate);
  file.require(
      false, "bit_rate_kbps",
      fmt::format("too slow: these frames load the bus to {} % with worst-case stuffing{}; must be at most {} %",
                  number_text(std::round(1000 * load) / 10), bus.foreign_load > 0 ? " and those of others" : "",
                  number_text(100 * kFullestBus)) +
          (fits.empty() ? "" : "; " + fits),
      {"wire", "sync_Hz", "set_point_every_nth_sync", "valve_status_every_nth_sync", "tilt_every_nth_sync",
       "controller_heartbeat_ms", "node_heartbeat_ms", "foreign_load_percent"});
}

}  // namespace knuckle
