#include "app/recordings/own_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "app/recordings/recording_reader.h"
#include "core/error.h"
#include "core/units.h"
#include "recording/recording.h"
#include "slave/slave_state.h"

namespace knuckle::recordings {

namespace {

constexpr const char* kMeasuredColumn = "measured";  // of `knuckle export`: 0 until every sensor has been heard
constexpr std::size_t kStretchesInNotes = 10;        // stretches of them

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Its name says seconds, and other programs' files say so of other units: Unix times are told by their size, others by
/// their step, as those of recordings within the units' steps do not overlap.
TimeUnit own_time_unit(CsvFile& file) {
  std::vector<std::size_t> columns;
  for (const std::string& name : own_columns()) columns.push_back(column_index(file, name));
  find_decimal_mark(file, columns);
  const TimesSeen times = times_seen(file, columns.front());
  if (const auto unit = unix_unit(times)) return *unit;
  for (const TimeUnit& unit : kTimeUnits)
    if (times.step * unit.factor >= kShortestStep_s && times.step * unit.factor <= kLongestStep_s) return unit;
  return kTimeUnits.front();
}

/// The mapping of Knuckle's own files: every column by its name.
Mapping own_mapping(const CsvFile& file, int without_pressures) {
  const std::vector<std::string>& header = file.rows.front();
  std::vector<std::string> missing;
  Mapping map;
  map.time.column = kOwnTimeColumn;
  map.gap_s = kOwnGap_s;
  if (!has(header, kOwnTimeColumn)) missing.emplace_back(kOwnTimeColumn);
  for (std::size_t c = 0; c < kSignalChannels; ++c) {
    if (static_cast<int>(c / 2) == without_pressures) continue;
    const char* name = kSignalNames[c];
    if (!has(header, name)) missing.emplace_back(name);
    map.channels.push_back({.name = name, .column = name});
  }
  for (std::size_t j = 0; j < kJoints; ++j) {
    const std::string valve = std::string(kJointNames[j]) + "_valve";
    if (has(header, valve)) map.channels.push_back({.name = valve, .column = valve});
  }
  if (has(header, kMeasuredColumn)) map.channels.push_back({.name = kMeasuredColumn, .column = kMeasuredColumn});
  if (missing.empty()) return map;
  std::string text = file.path + ": row 1: no column";
  for (const std::string& name : missing) text += (&name == &missing.front() ? " '" : ", '") + name + "'";
  if (has(header, "t_s") && has(header, "boom_A_bar"))
    throw InputError(text + ": the table of an older `knuckle simulate --csv` is no recording of the sensors");
  const std::string style = file.style();
  throw InputError(text + " as Knuckle's recordings have" + (style.empty() ? "" : " (read as " + style + ")") +
                   "; say with --map how to read another file");
}

}  // namespace

std::vector<std::string> own_columns() {
  std::vector<std::string> columns{kOwnTimeColumn};
  columns.insert(columns.end(), kSignalNames.begin(), kSignalNames.end());
  return columns;
}

bool has_own_columns(const CsvFile& file) {
  const std::vector<std::string> own = own_columns();
  return std::all_of(own.begin(), own.end(), [&](const std::string& name) { return has(file.rows.front(), name); });
}

MappedTable read_own_table(CsvFile file, int without_pressures) {
  Mapping map = own_mapping(file, without_pressures);
  const TimeUnit unit = own_time_unit(file);
  map.time.factor = unit.factor;
  MappedTable table = read_mapped_csv(std::move(file), map);
  if (unit.factor != 1)
    table.notes.push_back(std::string(kOwnTimeColumn) + " holds " + unit.name + ", not s: read as such");
  return table;
}

void forget_unmeasured(MappedTable& table) {
  const auto measured = std::find_if(table.channels.begin(), table.channels.end(),
                                     [](const MappedChannel& channel) { return channel.name == kMeasuredColumn; });
  if (measured == table.channels.end()) return;
  const std::vector<double> flags = std::move(measured->values);
  table.channels.erase(measured);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (flags[i] != 0) continue;
    rows.push_back(table.rows[i]);
    for (MappedChannel& channel : table.channels) {
      if (!channel.name.ends_with("_valve")) channel.values[i] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  if (!rows.empty())
    table.notes.push_back(std::to_string(rows.size()) + " x not measured (not used): row " +
                          row_list(rows, kStretchesInNotes));
}

namespace {

constexpr std::size_t kLeastSteps = 4;

/// Of a state's values, in the order of channels().
std::vector<double> values_of(const slave::SlaveState& state) {
  std::vector<double> values(state.pressure_Pa.begin(), state.pressure_Pa.end());
  for (const double length_m : state.cylinder_m) values.push_back(length_m);
  values.push_back(state.hull_pitch_rad);
  for (const double angle_rad : state.joint_rad) values.push_back(angle_rad);
  if (!state.measured) std::fill(values.begin(), values.end(), kUnknown);
  for (std::size_t c = 0; c < kPressureChannels; ++c)
    if ((state.unknown_torques >> c / 2 & 1) != 0) values[c] = kUnknown;
  for (const double command : state.valve_command) values.push_back(command);
  return values;
}

std::vector<MappedChannel> channels() {
  std::vector<MappedChannel> all;
  for (const char* name : kSignalNames) all.push_back({name, {}, name});
  for (const char* end : {"_rad", "_valve"}) {
    for (const char* joint : kJointNames) {
      const std::string name = std::string(joint) + end;
      all.push_back({name, {}, name});
    }
  }
  return all;
}

}  // namespace

bool is_recording(const std::string& path) {
  return path.ends_with(".mcap");
}

MappedTable table_of_recording(const std::vector<std::string>& parts, const std::string& map_path) {
  const std::string& path = parts.front();
  if (!map_path.empty())
    throw InputError(path + ": is a recording of Knuckle, which --map " + map_path + " does not describe");
  recording::Recording recording(parts);
  MappedTable table;
  table.source = path;
  table.channels = channels();
  table.gap_s = kOwnGap_s;
  Time first{};
  std::size_t backwards = 0;
  while (const auto entry = recording.next()) {
    if (entry->topic != recording::Topic::kMachineState) continue;
    const auto state = recording::state_in<slave::SlaveState>(*entry, recording);
    ++table.rows_read;
    if (table.time_s.empty()) first = state.at;
    const double time_s = to_seconds(state.at - first);
    if (!table.time_s.empty() && time_s <= table.time_s.back()) {
      ++backwards;
      continue;
    }
    table.time_s.push_back(time_s);
    table.rows.push_back(table.rows_read);
    const std::vector<double> values = values_of(state);
    for (std::size_t c = 0; c < values.size(); ++c) table.channels[c].values.push_back(values[c]);
  }
  table.until_s = table.time_s;
  table.notes = recording.damages();
  for (std::string& note : recording.order_notes()) table.notes.push_back(std::move(note));
  if (backwards > 0) table.notes.push_back(fmt::format("{} steps whose time does not go on: left out", backwards));
  std::erase_if(table.channels, [](const MappedChannel& channel) {
    return channel.name.ends_with("_valve") &&
           std::none_of(channel.values.begin(), channel.values.end(), [](double v) { return std::isfinite(v); });
  });
  if (table.time_s.size() < kLeastSteps)
    table.refuse(
        fmt::format("has {} steps of the machine's side, at least {} are needed", table.time_s.size(), kLeastSteps));
  return table;
}

}  // namespace knuckle::recordings
