#include "app/recordings/import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <limits>
#include <type_traits>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/recordings/own_table.h"
#include "core/error.h"
#include "core/units.h"
#include "machine/description.h"
#include "machine/file_text.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "recording/events.h"
#include "recording/fields.h"
#include "recording/file_names.h"
#include "recording/mcap/file_writer.h"
#include "recording/topics.h"
#include "slave/slave_state.h"

namespace knuckle::recordings {

namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 20, kMostStateBytes = 4096;
constexpr mcap::Compression kCompression{1};

/// Of which no number is known.
slave::SlaveState unknown_state() {
  slave::SlaveState state;
  visit_fields(state, [](const char*, auto& member) {
    using Member = std::remove_reference_t<decltype(member)>;
    if constexpr (std::is_same_v<Member, double>) member = kUnknown;
    if constexpr (VectorField<Member>) std::fill_n(member.data(), member.size(), kUnknown);
  });
  return state;
}

/// Values of a signal that the machine cannot have measured.
struct Outside {
  std::size_t count = 0, of = 0;
  double worst = 0, by = 0;  ///< The value that is farthest outside, and how far.
  std::size_t row = 0;       ///< Its row.
};
Outside outside(const RecordedFile& table, std::size_t channel, const SignalRange& range) {
  Outside found;
  for (std::size_t i = 0; i < table.recording.samples.size(); ++i) {
    if (table.recording.usable[i] == 0) continue;
    ++found.of;
    const double value = signal(table.recording.samples[i], channel);
    const double by = std::max(range.low - value, value - range.high);
    if (by <= 0) continue;
    ++found.count;
    if (by <= found.by) continue;
    found.by = by;
    found.worst = value;
    found.row = table.rows[i];
  }
  return found;
}

/// The commonest mistake of a mapping: a table in bar or MPa that is read as Pa is within every range.
void refuse_tiny_pressures(const RecordedFile& table) {
  constexpr double kSomePressure_Pa = 2e5;
  double most_Pa = -std::numeric_limits<double>::infinity();
  std::size_t row = 0;
  for (std::size_t i = 0; i < table.recording.samples.size(); ++i) {
    if (table.recording.usable[i] == 0) continue;
    const auto& pressures = table.recording.samples[i].pressure_Pa;
    const double highest_Pa = *std::max_element(pressures.begin(), pressures.end());
    if (highest_Pa <= most_Pa) continue;
    most_Pa = highest_Pa;
    row = table.rows[i];
  }
  if (most_Pa >= kSomePressure_Pa) return;
  throw InputError(
      fmt::format("{}: no pressure of the table reaches {:.4g} bar (the highest is {:.4g} bar, in row {}): the "
                  "pressures are in another unit than the mapping says",
                  table.recording.source, kSomePressure_Pa / 1e5, most_Pa / 1e5, row));
}

/// Other machines' lengths and pressures cannot be this one's, nor can a pitch in degrees be its hull's. @return notes
/// on the few that are not.
std::vector<std::string> refuse_another_machines(const RecordedFile& table, const MachineDescription& machine) {
  constexpr double kMostOutside = 0.2;
  std::vector<std::string> notes;
  for (std::size_t c = 0; c < kSignalChannels; ++c) {
    const SignalRange range = possible_range(machine, c);
    const Outside found = outside(table, c, range);
    if (found.count == 0) continue;
    const bool pressure = c < kPressureChannels;
    const double unit = pressure ? 1e5 : 1;
    const char* const unit_name = pressure ? "bar" : c + 1 < kSignalChannels ? "m" : "rad";
    const std::string where =
        fmt::format("outside what is possible at machine {}, {:.4g} to {:.4g} {} (most of all {:.4g} in row {})",
                    machine.name, range.low / unit, range.high / unit, unit_name, found.worst / unit, found.row);
    const double share = static_cast<double>(found.count) / static_cast<double>(found.of);
    if (share > kMostOutside)
      throw InputError(fmt::format(
          "{}: column '{}': {:.3g} % of it is {}; at most {:.0f} % may be: the table is of another machine, "
          "or in another unit",
          table.recording.source, table.columns[c], std::ceil(1000 * share) / 10, where, 100 * kMostOutside));
    notes.push_back(fmt::format("{} samples of {} are {}", found.count, table.columns[c], where));
  }
  refuse_tiny_pressures(table);
  return notes;
}

slave::SlaveState state_of(const estimation::Recording& recording, std::size_t sample,
                           const MachineDescription& machine, const Kinematics& kinematics) {
  const estimation::Measurement& measured = recording.samples[sample];
  slave::SlaveState state = unknown_state();
  state.at = Time(Duration(std::llround(1e9 * recording.step_s * static_cast<double>(sample))));
  state.measured = recording.usable[sample] != 0;
  if (!recording.valve.empty()) state.valve_command = recording.valve[sample];
  if (!state.measured) return state;
  state.oldest_age_s = 0;  // a row's cells are of the row's time
  state.pressure_Pa = measured.pressure_Pa;
  state.cylinder_m = measured.cylinder_m;
  state.hull_pitch_rad = measured.hull_pitch_rad;
  const JointVector length_m = measured.cylinder_m - machine.sensors.encoder_offset_m;
  for (int j = 0; j < kJoints; ++j) state.joint_rad[j] = kinematics.joint_at(j, length_m[j]).value_or(kUnknown);
  return state;
}

/// A file that is put in place at its end.
class File {
 public:
  File(std::string path, const recording::Head& head) : path_(std::move(path)) {
    if (!recording::may_be_replaced(path_)) throw InputError("--out " + path_ + ": is not a regular file");
    const auto folder = std::filesystem::absolute(path_).parent_path();
    if (!recording::make_folder(folder.string())) fail(errno);
    (void)std::remove(partial_.c_str());
    std::string partial = partial_;
    check(writer_.open(partial, recording::topics()));
    check(writer_.note(recording::metadata_of(head)));
    for (const mcap::Attachment& attachment : recording::attachments_of(head)) check(writer_.attach(attachment));
  }
  ~File() { (void)std::remove(partial_.c_str()); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void add(recording::Topic topic, Time time, std::span<const std::uint8_t> message) {
    const auto at = static_cast<std::uint64_t>(time.time_since_epoch().count());
    chunk_.add(recording::channel_of(topic), sequences_[static_cast<std::size_t>(topic)]++, at, at, message);
    if (chunk_.bytes() > kChunkBytes) check(writer_.append(chunk_.finish(kCompression)));
  }
  void put_in_place() {
    if (!chunk_.empty()) check(writer_.append(chunk_.finish(kCompression)));
    check(writer_.close());
    if (std::rename(partial_.c_str(), path_.c_str()) != 0) fail(errno);
  }

 private:
  void check(bool done) const {
    if (!done) fail(writer_.error());
  }
  [[noreturn]] void fail(int error) const {
    throw InputError("--out " + path_ + ": cannot be written: " + std::strerror(error));
  }

  std::string path_, partial_ = path_ + recording::kUnfinished;
  mcap::FileWriter writer_;
  mcap::ChunkBuilder chunk_;
  std::array<std::uint32_t, static_cast<std::size_t>(recording::Topic::kCount)> sequences_{};
};

}  // namespace

std::vector<std::string> write_imported(const RecordedFile& table, recording::Head head,
                                        const MachineDescription& machine, const std::string& path) {
  head.imported = head.has_machine = true;
  head.virtual_time = true;  // a table says how time went on, not when it was
  head.started_unix_ns = 0;
  std::vector<std::string> notes = table.notes;
  for (std::string& note : refuse_another_machines(table, machine)) notes.push_back(std::move(note));
  File file(path, head);
  for (const std::string& note : notes) {
    const recording::Event event{Time{}, recording::Severity::kInfo, "import", note};
    file.add(recording::Topic::kEvents, event.at, recording::encode_log(event, head.started_unix_ns));
  }
  const Kinematics kinematics(machine);
  std::vector<std::uint8_t> room(kMostStateBytes);
  for (std::size_t i = 0; i < table.recording.samples.size(); ++i) {
    cli::check_interrupt();
    const slave::SlaveState state = state_of(table.recording, i, machine, kinematics);
    recording::CdrWriter out(room);
    recording::put(out, state);
    file.add(recording::Topic::kMachineState, state.at, out.written());
  }
  file.put_in_place();
  return notes;
}

namespace {

struct ImportOptions {
  std::string table, map, machine, out;
};

int run_import(const ImportOptions& o) {
  const cli::InterruptGuard interrupt;
  cli::check_readable("the table", o.table);
  if (is_recording(o.table)) cli::refuse_option("the table", o.table, "is a recording already");
  if (!is_recording(o.out)) cli::refuse_option("--out", o.out, "must end in .mcap");
  if (!o.map.empty()) cli::check_readable("--map", o.map);
  const std::string machine_file = find_config("machine", o.machine);
  cli::Places places;
  places.input("the table", o.table);
  places.input("--map", o.map);
  places.input("--machine", machine_file);
  places.output("--out", o.out);
  places.output("--out", o.out + recording::kUnfinished);
  const MachineDescription machine = calibrated(load_machine(machine_file));
  const RecordedFile table = read_recording(o.table, o.map, machine);
  recording::Head head;
  head.program = "knuckle import";
  head.version = cli::program_version();
  head.machine_file = whole_file(machine_file, kLargestToml_MB);
  if (!o.map.empty()) head.mapping_file = whole_file(o.map, kLargestToml_MB);
  for (const std::string& note : write_imported(table, head, machine, o.out)) std::cout << note << '\n';
  return 0;
}

}  // namespace

cli::Command import_entry() {
  return cli::command<ImportOptions>(
      "import", "Another program's table of sensor signals (CSV) as a recording (.mcap)",
      [](const cli::OptionList& command, ImportOptions& o) {
        command.add_option("TABLE", o.table, "CSV file of sensor signals").required();
        command.add_option("--map", o.map,
                           "Mapping file (.toml) that says how to read it; not needed for Knuckle's own");
        command.add_option("--machine", o.machine, "Machine name or .toml file").required();
        command.add_option("--out", o.out, "The recording (a new .mcap)").required();
      },
      run_import);
}

}  // namespace knuckle::recordings
