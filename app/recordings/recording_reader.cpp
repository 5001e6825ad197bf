#include "app/recordings/recording_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "app/recordings/csv_reader.h"
#include "app/recordings/csv_row.h"
#include "app/recordings/own_table.h"
#include "core/error.h"
#include "core/quantile.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "machine/toml_reader.h"

namespace knuckle::recordings {
namespace {

using estimation::Measurement;
using estimation::Recording;
using Flags = std::vector<std::uint8_t>;

constexpr double kBridgedSteps = 4;          // a longer hole is none that a line may cross
constexpr double kSameInstant = 0.02;        // of a step: taken as it is, not interpolated
constexpr std::size_t kLongest = 4'000'000;  // samples

std::string joint_channel(std::size_t joint, const char* what) {
  return std::string(kJointNames[joint]) + what;
}

/// Values of one channel over time, unusable cells left out.
struct Knots {
  std::vector<double> t, value;
};

std::optional<Knots> knots_of(const MappedTable& table, const std::string& name) {
  for (const MappedChannel& channel : table.channels) {
    if (channel.name != name) continue;
    Knots knots;
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      if (!std::isfinite(channel.values[i])) continue;
      knots.t.push_back(table.time_s[i]);
      knots.value.push_back(channel.values[i]);
    }
    return knots;
  }
  return std::nullopt;
}

double usual_step(const MappedTable& table) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < table.time_s.size(); ++i) steps.push_back(table.time_s[i] - table.time_s[i - 1]);
  const double usual_s = median(steps), step_s = std::round(1e6 * usual_s) / 1e6;
  if (step_s < kShortestStep_s || step_s > kLongestStep_s) {
    table.refuse("its usual step in time is " + number_text(usual_s) + " s, must be within [" +
                 number_text(kShortestStep_s) + ", " + number_text(kLongestStep_s) + "]" +
                 (step_s > kLongestStep_s && step_s * 1e-3 >= kShortestStep_s ? ": looks like milliseconds" : ""));
  }
  return step_s;
}

/// One channel on the even grid.
struct Grid {
  std::vector<double> value;
  std::vector<std::uint8_t> usable;
  std::size_t bridged = 0;
};

Grid on_grid(const Knots& knots, double step_s, std::size_t count) {
  Grid grid;
  grid.value.assign(count, knots.value.empty() ? 0.0 : knots.value.front());
  grid.usable.assign(count, 0);
  for (std::size_t i = 0, k = 0; i < count && !knots.t.empty(); ++i) {
    const double t = step_s * static_cast<double>(i);
    while (k + 1 < knots.t.size() && knots.t[k + 1] <= t + kSameInstant * step_s) ++k;
    grid.value[i] = knots.value[k];
    if (std::abs(knots.t[k] - t) <= kSameInstant * step_s) {
      grid.usable[i] = 1;
    } else if (knots.t[k] < t && k + 1 < knots.t.size() &&
               knots.t[k + 1] - knots.t[k] <= (kBridgedSteps + 1.5) * step_s) {
      const double share = (t - knots.t[k]) / (knots.t[k + 1] - knots.t[k]);
      grid.value[i] += share * (knots.value[k + 1] - knots.value[k]);
      grid.usable[i] = 1;
      ++grid.bridged;
    }
  }
  return grid;
}

/// Fills a RecordedFile from a table.
class Builder {
 public:
  Builder(const MappedTable& table, const MachineDescription& machine)
      : table_(table), machine_(machine), kinematics_(machine) {}

  RecordedFile build() {
    Recording& recording = file_.recording;
    recording.source = table_.source;
    recording.step_s = usual_step(table_);
    const double count = std::floor(table_.time_s.back() / recording.step_s + 0.5) + 1;
    if (count > static_cast<double>(kLongest)) refuse_length();
    recording.samples.resize(static_cast<std::size_t>(count));
    recording.usable.assign(recording.samples.size(), 1);
    file_.notes = table_.report();
    file_.rows_read = table_.rows_read;
    place_rows();
    for (std::size_t c = 0; c < kPressureChannels; ++c) {
      if (measures(machine_, c))
        fill(c, channel(kSignalNames[c], c));
      else
        leave_out(c);
    }
    for (std::size_t j = 0; j < kJoints; ++j) fill_length(j);
    fill_pitch();
    fill_valves();
    note_holes();
    require_samples();
    return std::move(file_);
  }

 private:
  /// @throws InputError where the mapping has no such channel.
  Grid channel(const std::string& name, std::size_t as) {
    file_.columns[as] = table_.channel(name).column;
    return on_grid(*knots_of(table_, name), file_.recording.step_s, file_.recording.samples.size());
  }
  [[nodiscard]] bool mapped(const std::string& name) const { return knots_of(table_, name).has_value(); }

  /// The clock was set, or it is two recordings: the longest gap tells where.
  [[noreturn]] void refuse_length() const {
    std::size_t longest = 1;
    const auto gap_s = [&](std::size_t i) { return table_.time_s[i] - table_.time_s[i - 1]; };
    for (std::size_t i = 2; i < table_.time_s.size(); ++i) longest = gap_s(i) > gap_s(longest) ? i : longest;
    table_.refuse("more than " + std::to_string(kLongest) + " samples: its longest gap, " +
                  number_text(gap_s(longest)) + " s, ends at row " + std::to_string(table_.rows[longest]) +
                  ": split it there, or cut it");
  }

  void fill(std::size_t c, const Grid& grid) {
    Recording& recording = file_.recording;
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
      signal(recording.samples[i], c) = grid.value[i];
      if (grid.usable[i] == 0) recording.usable[i] = 0;
    }
    bridged_ = std::max(bridged_, grid.bridged);
    missing_[c] = static_cast<std::size_t>(std::count(grid.usable.begin(), grid.usable.end(), std::uint8_t{0}));
  }

  void leave_out(std::size_t c) {
    file_.columns[c] = kSignalNames[c];
    for (Measurement& sample : file_.recording.samples) sample.pressures_known[c / 2] = false;
  }

  void fill_length(std::size_t joint) {
    const std::size_t c = kPressureChannels + joint;
    const std::string angle = joint_channel(joint, "_rad");
    if (mapped(kSignalNames[c]) || !mapped(angle)) return fill(c, channel(kSignalNames[c], c));
    Grid grid = channel(angle, c);
    std::size_t beyond = 0;
    for (std::size_t i = 0; i < grid.value.size(); ++i) {
      const auto state = kinematics_.cylinder_at(static_cast<int>(joint), grid.value[i]);
      const LinkDescription& link = machine_.links[joint];
      constexpr double kMargin_rad = 0.05;
      const bool reached =
          state && grid.value[i] > link.min_rad - kMargin_rad && grid.value[i] < link.max_rad + kMargin_rad;
      if (!reached && grid.usable[i] != 0) ++beyond;
      if (!reached) grid.usable[i] = 0;
      const double offset_m = machine_.sensors.encoder_offset_m[static_cast<Eigen::Index>(joint)];
      grid.value[i] = reached ? state->length_m + offset_m : i > 0 ? grid.value[i - 1] : 0.0;
    }
    if (5 * beyond > grid.value.size()) {
      table_.refuse("column '" + file_.columns[c] + "': " + std::to_string(100 * beyond / grid.value.size()) +
                    " % of it is outside the " + kJointNames[joint] + "'s working range of " +
                    number_text(machine_.links[joint].min_rad) + " to " + number_text(machine_.links[joint].max_rad) +
                    " rad: another unit, sign, offset or joint");
    }
    if (beyond > 0)
      file_.notes.push_back(std::to_string(beyond) + " samples of " + file_.columns[c] +
                            " are outside the joint's working range (not used)");
    fill(c, grid);
  }

  /// A sensor on the boom feels the boom's own angle as well.
  void fill_pitch() {
    const std::size_t c = kSignalChannels - 1;
    if (mapped(kSignalNames[c]) || !mapped("boom_tilt_rad")) return fill(c, channel(kSignalNames[c], c));
    Grid grid = channel("boom_tilt_rad", c);
    for (std::size_t i = 0; i < grid.value.size(); ++i) {
      const double length_m = file_.recording.samples[i].cylinder_m[kBoom] - machine_.sensors.encoder_offset_m[kBoom];
      const auto boom_rad = kinematics_.joint_at(kBoom, length_m);
      if (!boom_rad) grid.usable[i] = 0;
      grid.value[i] -= boom_rad.value_or(grid.value[i]);
    }
    fill(c, grid);
  }

  /// Commands are no less believable for a hole in another channel, nor the other channels for a hole in these.
  void fill_valves() {
    Recording& recording = file_.recording;
    for (std::size_t j = 0; j < kJoints; ++j) {
      const std::string name = joint_channel(j, "_valve");
      const auto knots = knots_of(table_, name);
      if (!knots) continue;
      file_.valve_columns[j] = table_.channel(name).column;
      if (recording.valve.empty())
        recording.valve.assign(recording.samples.size(),
                               JointVector::Constant(std::numeric_limits<double>::quiet_NaN()));
      const Grid grid = on_grid(*knots, recording.step_s, recording.samples.size());
      std::size_t unknown = 0;
      for (std::size_t i = 0; i < grid.value.size(); ++i) {
        if (grid.usable[i] != 0)
          recording.valve[i][static_cast<Eigen::Index>(j)] = grid.value[i];
        else
          ++unknown;
      }
      if (unknown > 0)
        file_.notes.push_back(std::to_string(unknown) + " samples of " + file_.valve_columns[j] +
                              " lie in longer holes: not used for this valve");
    }
  }

  void place_rows() {
    const double step_s = file_.recording.step_s;
    std::size_t k = 0;
    for (std::size_t i = 0; i < file_.recording.samples.size(); ++i) {
      while (k + 1 < table_.time_s.size() && table_.time_s[k] < step_s * (static_cast<double>(i) - kSameInstant)) ++k;
      file_.rows.push_back(table_.rows[k]);
    }
  }

  void note_holes() {
    const auto unusable = static_cast<std::size_t>(
        std::count(file_.recording.usable.begin(), file_.recording.usable.end(), std::uint8_t{0}));
    if (bridged_ > 0)
      file_.notes.push_back(std::to_string(bridged_) + " samples lie between rows or in short holes: interpolated");
    if (unusable > 0) file_.notes.push_back(std::to_string(unusable) + " samples lie in longer holes: not used");
    std::size_t of_all = file_.recording.samples.size();  // whole rows
    for (std::size_t c = 0; c < kSignalChannels; ++c)
      if (measures(machine_, c)) of_all = std::min(of_all, missing_[c]);
    for (std::size_t c = 0; c < kSignalChannels; ++c) {
      if (missing_[c] > of_all)
        file_.notes.push_back(std::to_string(missing_[c]) + " of them for want of " + file_.columns[c]);
    }
  }

  /// A sample needs all signals: those of which there is nothing are named, and no others.
  void require_samples() const {
    const Flags& usable = file_.recording.usable;
    if (std::find(usable.begin(), usable.end(), 1) != usable.end()) return;
    std::string empty, missing;
    for (std::size_t c = 0; c < kSignalChannels; ++c) {
      if (missing_[c] == usable.size()) empty += (empty.empty() ? "column '" : ", '") + file_.columns[c] + "'";
      if (missing_[c] > 0) missing += (missing.empty() ? " '" : ", '") + file_.columns[c] + "'";
    }
    table_.refuse(empty.empty() ? "no row has all signals; with longer holes:" + missing
                                : empty + " has no usable value");
  }

  const MappedTable& table_;
  const MachineDescription& machine_;
  Kinematics kinematics_;
  RecordedFile file_;
  std::size_t bridged_ = 0;
  std::array<std::size_t, kSignalChannels> missing_{};
};

}  // namespace

double& signal(Measurement& measurement, std::size_t channel) {
  if (channel < kPressureChannels) return measurement.pressure_Pa[channel];
  if (channel == kSignalChannels - 1) return measurement.hull_pitch_rad;
  return measurement.cylinder_m[static_cast<Eigen::Index>(channel - kPressureChannels)];
}

double signal(const Measurement& measurement, std::size_t channel) {
  return signal(const_cast<Measurement&>(measurement), channel);
}

bool measures(const MachineDescription& machine, std::size_t channel) {
  return channel >= kPressureChannels || static_cast<int>(channel / 2) != machine.sensors.without_pressures;
}

SignalRange possible_range(const MachineDescription& machine, std::size_t channel) {
  constexpr double kLeast_Pa = -2e5, kSteepest_rad = 0.35, kLengthRoom_m = 0.03;
  if (channel < kPressureChannels) return {kLeast_Pa, machine.sensors.pressure_range_Pa};
  if (channel == kSignalChannels - 1) return {-kSteepest_rad, kSteepest_rad};
  const std::size_t joint = channel - kPressureChannels;
  const double offset_m = machine.sensors.encoder_offset_m[static_cast<Eigen::Index>(joint)];
  const CylinderDescription& cylinder = machine.cylinders[joint];
  return {cylinder.min_length_m + offset_m - kLengthRoom_m, cylinder.max_length_m + offset_m + kLengthRoom_m};
}

RecordedFile read_recording(const std::string& path, const std::string& map_path, const MachineDescription& machine) {
  if (is_recording(path)) {
    return Builder(table_of_recording({path}, map_path), machine).build();
  }
  MappedTable table = map_path.empty()
                          ? read_own_table(read_cells(path, own_columns()), machine.sensors.without_pressures)
                          : read_mapped_csv(path, map_path);
  forget_unmeasured(table);
  refuse_halfway_changes(table);
  return Builder(table, machine).build();
}

void write_recording(const Recording& recording, std::ostream& out) {
  const bool valves = !recording.valve.empty();
  RowWriter header(out, true), rows(out, false);
  header.word(kOwnTimeColumn, "");
  for (const char* name : kSignalNames) header.word(name, "");
  for (std::size_t j = 0; j < kJoints && valves; ++j) header.word(joint_channel(j, "_valve"), "");
  header.end_row();
  header.flush();
  const auto add = [&rows](bool known, double value) {
    if (known)
      rows.exact("", value);
    else
      rows.word("", "");
  };
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    rows.exact("", std::round(1e9 * recording.step_s * static_cast<double>(i)) / 1e9);
    const Measurement& sample = recording.samples[i];
    for (std::size_t c = 0; c < kSignalChannels; ++c)
      add(recording.usable[i] != 0 && (c >= kPressureChannels || sample.pressures_known[c / 2]), signal(sample, c));
    for (int j = 0; j < kJoints && valves; ++j) add(std::isfinite(recording.valve[i][j]), recording.valve[i][j]);
    rows.end_row();
  }
}

Recording part_of(const Recording& recording, std::size_t first, std::size_t last) {
  const auto cut = [&](const auto& all) {
    using Values = std::decay_t<decltype(all)>;
    return all.empty() ? Values{}
                       : Values(all.begin() + static_cast<std::ptrdiff_t>(first),
                                all.begin() + static_cast<std::ptrdiff_t>(last));
  };
  return {recording.source, recording.step_s, cut(recording.samples), cut(recording.usable), cut(recording.valve)};
}

}  // namespace knuckle::recordings
