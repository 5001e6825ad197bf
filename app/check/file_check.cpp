#include "app/check/file_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "app/battery/settings.h"
#include "app/cli/output_file.h"
#include "app/recordings/csv_mapping.h"
#include "app/session/link_file.h"
#include "app/session/scenario.h"
#include "app/session/truth_file.h"
#include "core/error.h"
#include "machine/load.h"
#include "machine/room.h"
#include "machine/toml_reader.h"

namespace knuckle::checking {

namespace {

/// What a file is checked as, and with which machine.
struct Subject {
  std::string file, machine;

  [[nodiscard]] MachineDescription its_machine() const {
    return load_machine(find_config("machine", machine.empty() ? "solar015" : machine));
  }
};

void check_machine(const Subject& of, FileCheck& found) {
  found.machine = calibrated(load_machine(of.file));
  found.lines = machine_sheet(*found.machine);
  found.notes = machine_notes(*found.machine);
}

void check_device(const Subject& of, FileCheck& found) {
  const DeviceDescription device = load_device(of.file);
  if (!of.machine.empty()) check_springs(of.its_machine(), device);
  found.lines = device_sheet(device);
}

void check_scenario(const Subject& of, FileCheck& found) {
  const MachineDescription machine = of.its_machine();
  const session::Scenario scenario = session::load_scenario(of.file, machine);
  found.lines.push_back(fmt::format("on machine '{}': {} phases, {:g} s at most, {} faults", machine.name,
                                    scenario.phases.size(), scenario.duration_s, scenario.faults.size()));
}

void check_link(const Subject& of, FileCheck& found) {
  const session::LinkFile link = session::load_link(of.file);
  for (const auto& [name, way] :
       {std::pair{"to the machine", &link.to_machine}, {"to the operator", &link.to_operator}})
    found.lines.push_back(fmt::format("{}: delay {:g} ms, jitter {:g} ms, loss {:g} %, {} changes, {} outages", name,
                                      1e3 * to_seconds(way->delay), 1e3 * to_seconds(way->jitter + way->slow_jitter),
                                      100 * way->loss, way->changes.size(), way->outages.size()));
}

void check_mapping(const Subject& of, FileCheck& found) {
  const recordings::Mapping map = recordings::read_mapping(of.file);
  for (const recordings::ChannelMap& channel : map.channels)
    found.lines.push_back(fmt::format("{:<20} = {:g} * '{}' + {:g}, in SI units", channel.name, channel.factor,
                                      channel.column, channel.offset));
}

void check_truth(const Subject& of, FileCheck& found) {
  const MachineDescription machine = of.its_machine();
  (void)session::load_truth(of.file, machine);
  found.lines.push_back(fmt::format("true parameters of a simulated '{}'", machine.name));
}

void check_grid(const Subject& of, FileCheck& found) {
  const battery::Settings grid = battery::load_settings(of.file);
  found.lines.push_back(fmt::format("{} sessions of the battery '{}' with machine '{}'", grid.sessions,
                                    battery::name(grid.kind), grid.machine));
}

/// A kind of file, and names that only it has at its top.
struct FileKind {
  const char* name;
  std::vector<const char*> keys;
  void (*check)(const Subject& of, FileCheck& found);
  bool of_machine = false;  ///< What it says depends on the machine it is for.
};

const std::vector<FileKind>& kinds() {
  static const std::vector<FileKind> kAll{
      {"machine",
       {"links", "mounts", "cylinders", "bucket_profile", "hydraulics", "sensors", "bus", "limits", "control"},
       check_machine},
      {"device", {"joints", "feel", "watchdog_ms"}, check_device, true},
      {"scenario",
       {"phase", "operator", "start_deg", "hand_deg", "reference_reach_m", "wall", "soil", "fault"},
       check_scenario,
       true},
      {"link", {"both", "to_machine", "to_operator", "change", "outage", "address_change"}, check_link},
      {"mapping", {"channel", "time"}, check_mapping},
      {"grid", {"battery", "sessions", "rtt_ms", "jitter_ms", "loss", "family"}, check_grid},
      {"truth",
       {"boom", "arm", "bucket", "hull", "pressure_offset_bar", "encoder_offset_mm", "encoder_scale", "cross_talk",
        "pressure_lag_ms", "hull_pitch_deg", "tilt_offset_deg", "warm_up_K", "pump_ripple_bar", "viscosity_factor"},
       check_truth,
       true},
  };
  return kAll;
}

/// The one that most of the file's names are of.
const FileKind& kind_of(const std::string& file) {
  const TomlTable content = TomlTable::read(file);
  if (content.document().empty()) throw InputError(file + ": is empty: nothing to check");
  const auto names = [&content](const FileKind& kind) {
    return std::count_if(kind.keys.begin(), kind.keys.end(), [&](const char* key) { return content.has(key); });
  };
  const auto& all = kinds();
  const auto most = std::max_element(all.begin(), all.end(),
                                     [&](const FileKind& a, const FileKind& b) { return names(a) < names(b); });
  if (names(*most) > 0) return *most;
  std::string expected;
  for (const FileKind& kind : all)
    expected += fmt::format("{}{} ([{}])", expected.empty() ? "" : ", ", kind.name, kind.keys.front());
  throw InputError(file + ": is none of the files that can be checked, by its tables: " + expected);
}

}  // namespace

FileCheck check_file(const std::string& file, const std::string& machine) {
  const FileKind& kind = kind_of(file);
  if (!machine.empty() && !kind.of_machine)
    cli::refuse_option("--machine", machine, fmt::format("does not go with a file of kind {}", kind.name));
  FileCheck found;
  found.kind = kind.name;
  try {
    kind.check({file, machine}, found);
  } catch (const FileErrors& errors) {
    found = {kind.name, errors.lines(), {}, {}, {}};
  }
  return found;
}

namespace {

struct Options {
  std::string file, machine, drawing;
};

int run(const Options& o) {
  cli::Places places;
  places.input("the file", o.file);
  places.configuration("--machine", o.machine);
  places.output("--drawing", o.drawing);
  const FileCheck found = check_file(o.file, o.machine);
  if (!found.errors.empty()) {
    for (const std::string& error : found.errors) std::cerr << "knuckle: " << error << '\n';
    return 2;
  }
  std::optional<cli::OutputFile> drawing;
  if (!o.drawing.empty()) {
    if (!found.machine)
      cli::refuse_option("--drawing", o.drawing, "only goes with a machine file; this is of kind " + found.kind);
    drawing.emplace("--drawing", o.drawing);
    draw_machine_sheet(*found.machine, drawing->stream());
  }
  std::ostream& out = cli::is_standard_output(o.drawing) ? std::cerr : std::cout;
  out << o.file << ": " << found.kind << " file, no errors\n";
  for (const std::string& line : found.lines) out << "  " << line << '\n';
  for (const std::string& note : found.notes) out << "  note: " << note << '\n';
  if (drawing) {
    drawing->commit();
    out << "  drawing: " << o.drawing << '\n';
  }
  return 0;
}

}  // namespace

cli::Command check_entry() {
  return cli::command<Options>(
      "check", "All that is wrong with a configuration file at once; of a right one, what follows from its numbers",
      [](const cli::OptionList& command, Options& o) {
        command.add_option("FILE", o.file, "Machine, device, scenario, link, mapping, truth or grid file (.toml)")
            .required();
        command.add_option("--machine", o.machine,
                           "Machine that a scenario, truth or device file is for: name or .toml file (default: "
                           "solar015; a device file is then checked without a machine)");
        command.add_option("--drawing", o.drawing, "Draw a machine file's arm, pins, joint ranges and limits (.svg)");
      },
      run);
}

}  // namespace knuckle::checking
