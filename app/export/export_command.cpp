#include "app/export/export_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "core/error.h"
#include "machine/description.h"
#include "machine/load.h"
#include "recording/recording.h"

namespace knuckle::exporting {
namespace {

/// A file that is made of the machine file alone.
struct MachineOutput {
  const char *option, *about;
  void (*write)(const MachineDescription& machine, std::ostream& out);
};
constexpr std::array kMachineOutputs{
    MachineOutput{"--urdf", "The arm as URDF: links, joints, inertias, shapes without meshes", write_urdf},
    MachineOutput{"--dbc", "The machine's CAN bus as DBC: every frame and what is in it", write_dbc},
};

struct Options {
  std::vector<std::string> recordings;  ///< The parts of one.
  std::string machine, bus;
  std::array<std::string, kMachineOutputs.size()> targets;  ///< Empty: not asked for.
  std::string csv, side, hdf5, candump, pictures;
  std::optional<double> from_s, to_s;
};

using Files = std::list<cli::OutputFile>;

bool wants_machine(const Options& o) {
  return !o.targets[0].empty() || !o.targets[1].empty();
}

bool wants_recording(const Options& o) {
  return !o.csv.empty() || !o.hdf5.empty() || !o.candump.empty() || !o.pictures.empty();
}

void check_places(const Options& o, const std::string& machine_file) {
  cli::Places places;
  places.input("--machine", machine_file);
  for (const std::string& file : o.recordings) places.input("the recording", file);
  for (std::size_t i = 0; i < kMachineOutputs.size(); ++i) places.output(kMachineOutputs[i].option, o.targets[i]);
  places.output("--csv", o.csv);
  places.output("--hdf5", o.hdf5);
  places.output("--candump", o.candump);
}

/// Options that would change nothing are misunderstandings.
void check(const Options& o) {
  if (!wants_machine(o) && !wants_recording(o))
    throw InputError(
        "nothing to write: give --csv, --hdf5, --candump, --urdf or --dbc, each with FILE, or --pictures FOLDER (see "
        "knuckle export --help)");
  const std::array needs_recording{std::pair{"--csv", &o.csv}, std::pair{"--hdf5", &o.hdf5},
                                   std::pair{"--candump", &o.candump}, std::pair{"--pictures", &o.pictures}};
  for (const auto& [option, target] : needs_recording) {
    if (!target->empty() && o.recordings.empty()) cli::refuse_option(option, *target, "needs a recording (.mcap)");
  }
  if (!o.recordings.empty() && !o.machine.empty())
    cli::refuse_option("--machine", o.machine, "does not go with a recording, which has its own");
  if (o.recordings.empty() && o.machine.empty())
    throw InputError("--urdf and --dbc need --machine NAME or a recording (.mcap)");
  if (!o.bus.empty() && !wants_machine(o)) cli::refuse_option("--bus", o.bus, "only goes with --dbc");
  if (!o.side.empty() && o.csv.empty()) cli::refuse_option("--side", o.side, "only goes with --csv");
  if (!o.side.empty() && o.side != "machine" && o.side != "operator")
    cli::refuse_option("--side", o.side, "must be machine or operator");
  for (const auto& [option, given] : {std::pair{"--from", o.from_s}, std::pair{"--to", o.to_s}}) {
    constexpr double kLongest_s = 1e9;
    if (given && !wants_recording(o))
      cli::refuse_option(option, "", "only goes with --csv, --hdf5, --candump or --pictures");
    cli::check_range(option, given, 0, kLongest_s, " s");
  }
  if (o.from_s && o.to_s && *o.from_s > *o.to_s) cli::refuse_option("--to", "", "must not be before --from");
  if (!o.pictures.empty()) cli::check_folder("--pictures", o.pictures);
  if (cli::is_standard_output(o.hdf5))
    cli::refuse_option("--hdf5", o.hdf5, "must be a file: HDF5 is not written in one stream");
}

/// Of which loop the table is. @throws InputError where both were recorded and none was named, or that one was not.
recording::Side side_of(const Options& o, const recording::Recording& recording) {
  const recording::Head& head = recording.head();
  if (o.side.empty() && head.has_machine && head.has_operator)
    throw InputError("--csv: both sides are in " + recording.source() + ": give --side machine or --side operator");
  if (!head.has_machine && !head.has_operator)
    throw InputError("--csv: no loop's steps are in " + recording.source() + ": it is of " + head.program);
  const bool machine = o.side.empty() ? head.has_machine : o.side == "machine";
  if (!(machine ? head.has_machine : head.has_operator))
    cli::refuse_option("--side", o.side, "is not in " + recording.source());
  return machine ? recording::Side::kMachine : recording::Side::kOperator;
}

/// With the one of two buses that --bus names.
MachineDescription with_one_bus(const Options& o, MachineDescription machine) {
  const bool dbc = !o.targets[1].empty();
  const auto on = machine.bus.line_named(o.bus);
  if (!o.bus.empty() && (!on || !dbc))
    cli::refuse_option("--bus", o.bus, dbc ? "no such bus in the machine file" : "only goes with --dbc");
  if (dbc && o.bus.empty() && machine.bus.second)
    cli::refuse_option("--dbc", o.targets[1], "needs --bus: the machine has " + machine.bus.line_names());
  machine.bus = machine.bus.alone(on.value_or(0));
  return machine;
}

void write_machine(const Options& o, const MachineDescription& read, Files& files) {
  const MachineDescription machine = with_one_bus(o, read);
  for (std::size_t i = 0; i < kMachineOutputs.size(); ++i) {
    if (o.targets[i].empty()) continue;
    kMachineOutputs[i].write(machine, files.emplace_back(kMachineOutputs[i].option, o.targets[i]).stream());
  }
}

MachineDescription machine_of(const recording::Recording& recording) {
  const std::string& text = recording.head().machine_file;
  if (text.empty()) throw InputError(recording.source() + ": holds no machine file: --urdf and --dbc need one");
  return parse_machine(text, recording.source() + ": " + recording::kMachineFile);
}

/// Complete or not there, each by itself: there may be thousands.
void write_picture(const std::string& folder, const recording::CameraPicture& picture) {
  std::string camera = picture.camera;  // of a foreign file: it must lead nowhere else
  std::replace_if(
      camera.begin(), camera.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-'; }, '_');
  const std::string name = fmt::format("{}_{:010.3f}.jpg", camera, to_seconds(picture.at));
  cli::OutputFile file("--pictures", folder + '/' + name);
  file.stream().write(reinterpret_cast<const char*>(picture.jpeg.data()), std::ssize(picture.jpeg));
  file.commit();
}

/// What is now there, a line each, on standard output unless that was an output itself.
void tell(const Options& o, const recording::Recording* recording, std::size_t pictures) {
  std::vector<std::pair<std::string, std::string>> written{
      {o.csv, recording != nullptr && !o.csv.empty()
                  ? fmt::format("states of the {}'s side", name(side_of(o, *recording)))
                  : ""},
      {o.hdf5, "states of both sides, events and files"},
      {o.candump, "CAN frames"},
      {o.targets[0], "the arm as URDF"},
      {o.targets[1], "the CAN bus as DBC"}};
  const bool streams =
      std::any_of(written.begin(), written.end(), [](const auto& one) { return cli::is_standard_output(one.first); });
  std::ostream& out = streams ? std::cerr : std::cout;
  for (const auto& [file, what] : written) {
    if (file.empty() || cli::is_standard_output(file)) continue;
    std::error_code unknown;  // a pipe has no size
    const auto bytes = std::filesystem::file_size(file, unknown);
    out << "written: " << file << ": " << what << (unknown ? "" : fmt::format(", {} bytes", bytes)) << '\n';
  }
  if (!o.pictures.empty()) out << "written: " << o.pictures << ": " << pictures << " pictures of cameras\n";
}

/// @return how many pictures were written.
std::size_t write_recording(const Options& o, recording::Recording& recording, const cli::InterruptGuard& interrupt,
                            Files& files) {
  RecordingOutputs outputs;
  outputs.check = [&interrupt] { interrupt.check(); };
  if (!o.csv.empty()) {
    outputs.side = side_of(o, recording);
    outputs.csv = &files.emplace_back("--csv", o.csv).stream();
  }
  if (!o.hdf5.empty()) outputs.hdf5 = &files.emplace_back("--hdf5", o.hdf5);
  if (!o.candump.empty()) outputs.candump = &files.emplace_back("--candump", o.candump).stream();
  std::size_t pictures = 0;
  if (!o.pictures.empty())
    outputs.picture = [&](const recording::CameraPicture& picture) {
      write_picture(o.pictures, picture);
      ++pictures;
    };
  if (o.from_s) outputs.from = Time(from_seconds(*o.from_s));
  if (o.to_s) outputs.to = Time(from_seconds(*o.to_s));
  export_recording(recording, outputs);
  for (const std::string& remark : remarks(recording)) std::cerr << "knuckle export: " << remark << '\n';
  return pictures;
}

int run(const Options& o) {
  check(o);
  const cli::InterruptGuard interrupt;
  const std::string machine_file = o.machine.empty() ? "" : find_config("machine", o.machine);
  check_places(o, machine_file);
  Files files;  // all written before the first is put in place
  std::optional<recording::Recording> recording;
  std::size_t pictures = 0;
  if (o.recordings.empty()) {
    write_machine(o, load_machine(machine_file), files);
  } else {
    recording.emplace(o.recordings);
    if (wants_machine(o)) write_machine(o, machine_of(*recording), files);
    if (wants_recording(o)) pictures = write_recording(o, *recording, interrupt, files);
  }
  for (cli::OutputFile& file : files) file.commit();
  tell(o, recording ? &*recording : nullptr, pictures);
  return recording && !recording->damages().empty() ? 1 : 0;
}

void add_options(const cli::OptionList& command, Options& o) {
  command.add_option("RECORDING", o.recordings, "Recording (.mcap); of several parts all, in their order");
  command.add_option("--machine", o.machine, "Machine name or .toml file, instead of a recording's");
  command.add_option("--bus", o.bus, "With --dbc: which bus, by its name, where the machine has two");
  command.add_option("--csv", o.csv, "The recorded states of one side as a table, a row a step (- = standard output)");
  command.add_option("--side", o.side, "Whose: machine or operator; needed where both are recorded");
  command.add_option("--hdf5", o.hdf5, "The recorded states of both sides, events and files as HDF5");
  command.add_option("--candump", o.candump,
                     "The recorded CAN frames of both directions in candump log format (- = standard output)");
  command.add_option("--pictures", o.pictures,
                     "Folder for the recorded pictures of cameras: CAMERA_SECONDS.jpg, by the recording's time");
  command.add_option("--from", o.from_s,
                     "Only steps, events, frames and pictures from here on, in seconds of the recording");
  command.add_option("--to", o.to_s, "Only those up to here");
  for (std::size_t i = 0; i < kMachineOutputs.size(); ++i) {
    command.add_option(kMachineOutputs[i].option, o.targets[i],
                       std::string(kMachineOutputs[i].about) + " (- = standard output)");
  }
}

}  // namespace

cli::Command export_entry() {
  return cli::command<Options>(
      "export",
      "Files for other tools: a recording as CSV, HDF5 or candump log; the machine's model as URDF, its bus as DBC",
      add_options, run);
}

}  // namespace knuckle::exporting
