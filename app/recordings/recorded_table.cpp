#include "app/recordings/recorded_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "app/recordings/recording_reader.h"
#include "core/error.h"
#include "core/units.h"
#include "recording/fields.h"
#include "recording/recording.h"
#include "slave/slave_state.h"

namespace knuckle::recordings {
namespace {

constexpr std::size_t kLeastSteps = 4;

/// Of a state's values, in the order of channels().
std::vector<double> values_of(const slave::SlaveState& state) {
  std::vector<double> values(state.pressure_Pa.begin(), state.pressure_Pa.end());
  for (const double length_m : state.cylinder_m) values.push_back(length_m);
  values.push_back(state.hull_pitch_rad);
  for (const double angle_rad : state.joint_rad) values.push_back(angle_rad);
  if (!state.measured) std::fill(values.begin(), values.end(), kUnknown);
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

MappedTable read_recorded_table(const std::vector<std::string>& parts, const std::string& map_path) {
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
    slave::SlaveState state;
    if (!recording::decode(entry->data, state))
      throw InputError(path + ": /machine/state is not that of this version of Knuckle");
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
