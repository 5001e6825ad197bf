#include "app/replay/replay_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iostream>
#include <optional>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/replay/force_comparison.h"
#include "core/error.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "recording/recording.h"

namespace knuckle::replay {
namespace {

constexpr const char* kOfMachines = "links";  // tables that only one kind of file has
constexpr const char* kOfDevices = "joints";

/// Which of the two a file has replaced.
struct Replaced {
  bool machine = false, device = false;
};

/// Of a name among the configuration, or a file.
std::string file_of(const std::string& name_or_file) {
  const bool device = has_config("device", name_or_file);
  if (device && has_config("machine", name_or_file))
    cli::refuse_option("--with", name_or_file, "is the name of a machine and of a device: name the file");
  if (device) return find_config("device", name_or_file);
  try {
    return find_config("machine", name_or_file);
  } catch (const InputError& error) {
    throw InputError(
        fmt::format("--with: {}; of devices there are {}", error.what(), fmt::join(config_names("device"), ", ")));
  }
}

/// Replaces the machine or the device that the file describes.
void put_in(const std::string& file, recording::ReplaySetup& setup, Replaced& replaced) {
  const auto once = [&file](bool& done, const char* what) {
    if (std::exchange(done, true)) cli::refuse_option("--with", file, std::string("is a second ") + what + " file");
  };
  const TomlTable content = TomlTable::read(file);
  if (content.has(kOfMachines)) {
    setup.machine = calibrated(load_machine(file));
    return once(replaced.machine, "machine");
  }
  if (!content.has(kOfDevices))
    throw InputError(
        fmt::format("--with {}: is neither a machine file: it has no [{}], nor a device file: it has no [{}]", file,
                    kOfMachines, kOfDevices));
  setup.device = load_device(file);
  once(replaced.device, "device");
}

}  // namespace

void change(recording::ReplaySetup& setup, const Changes& changes) {
  setup.changed = changes.any();
  Replaced replaced;
  for (const std::string& file : changes.with) put_in(file_of(file), setup, replaced);
  if (!changes.contact_model.empty()) {
    if (!contact_model_named(changes.contact_model))
      cli::refuse_option("--contact-model", changes.contact_model, kContactModelChoice);
    // The text is that of the file as it was read: what it has of a calibration is applied anew.
    setup.machine = calibrated(with_contact_model(setup.machine, changes.contact_model));
  }
  if (changes.control.empty()) return;
  if (!control_law_named(changes.control)) cli::refuse_option("--control", changes.control, kControlLawChoice);
  setup.head.law = changes.control;
}

namespace {

struct Options {
  std::vector<std::string> files;
  std::vector<std::string> with;
  std::string control;
  std::string contact_model;
  std::string true_force;
};

void print(const recording::Divergence& first) {
  std::cout << fmt::format("{}: first difference at {:.4f} s (step {}):\n", name(first.side), to_seconds(first.at),
                           first.step);
  for (const std::string& line : first.what) std::cout << "  " << line << '\n';
  std::cout << fmt::format("  read in this step: {}\n", first.inputs.empty() ? "nothing" : "");
  for (const std::string& line : first.inputs) std::cout << "    " << line << '\n';
}

/// The largest differences of each side, relative to nothing: their units are in their names. Of words the first.
void print_fields(const recording::SideResult& side) {
  if (side.fields.empty()) return;
  std::cout << fmt::format("  {:<34} {:>14} {:>10} {:>9}\n", "field", "largest diff.", "at s", "steps");
  for (const auto& [name, field] : side.fields)
    std::cout << fmt::format("  {:<34} {:>14} {:>10.3f} {:>9}\n", name,
                             field.names.empty() ? fmt::format("{:.6g}", field.largest) : field.names,
                             to_seconds(field.at), field.steps);
}

int run(const Options& o) {
  if (!o.true_force.empty() && o.contact_model.empty())
    cli::refuse_option("--true-force", o.true_force, "only goes with --contact-model");
  const cli::InterruptGuard interrupt;
  recording::Recording recording(o.files);
  recording::ReplaySetup setup = recording::setup_of(recording);
  const ContactModel recorded_model = setup.machine.force.contact_model;
  change(setup, {o.with, o.control, o.contact_model});
  const auto watch = [](Time, const auto& /*loop*/) { cli::check_interrupt(); };
  recording::ReplayTaps taps{watch, watch};
  std::optional<ForceComparison> forces;
  if (!o.contact_model.empty()) {
    forces.emplace(recorded_model, setup.machine.force.contact_model, o.true_force);
    taps.machine_states = [&forces](const auto& recorded, const auto& replayed) { forces->add(recorded, replayed); };
  }
  const recording::ReplayResult result = recording::replay(recording, setup, std::move(taps));
  const std::string comparison = forces ? forces->text() : "";
  for (const std::string& remark : remarks(recording)) std::cerr << "knuckle replay: " << remark << '\n';
  for (std::size_t i = 0; i < result.sides.size(); ++i) {
    const recording::SideResult& side = result.sides[i];
    if (!side.recorded) continue;
    std::cout << fmt::format("{}: {} steps, {} different, {} missing\n", name(static_cast<recording::Side>(i)),
                             side.steps, side.differing, side.missing);
    if (side.unreadable > 0)
      std::cout << fmt::format("  {} messages are none of this version's: recorded by version {}\n", side.unreadable,
                               recording.head().version);
    if (side.first) print(*side.first);
    print_fields(side);
  }
  std::cout << comparison;
  if (!result.changes.empty()) std::cout << "what was held of the machine:\n";
  for (const recording::Change& change : result.changes)
    std::cout << fmt::format("  {:>10.3f} s  {}: recorded \"{}\", replayed \"{}\"\n", to_seconds(change.at),
                             name(change.side), change.recorded, change.replayed);
  const bool whole = recording.damages().empty();
  if (result.identical()) std::cout << (whole ? "identical, bit by bit\n" : "identical as far as it can be read\n");
  if (setup.changed) return whole ? 0 : 1;
  if (!result.identical() && recording.head().version != cli::program_version())
    std::cout << "recorded by version " << recording.head().version << ", run again by " << cli::program_version()
              << '\n';
  return result.identical() && whole ? 0 : 1;
}

}  // namespace

cli::Command replay_entry() {
  return cli::command<Options>(
      "replay", "Run the loops of a recording again on what they read, and compare bit by bit",
      [](const cli::OptionList& command, Options& o) {
        command.add_option("RECORDING", o.files, "Recording (.mcap); of several parts all, in their order").required();
        command.add_option(
            "--with", o.with,
            "Machine or device, name or .toml file, in place of the recorded one: what would have differed?");
        command.add_option("--control", o.control, "Bilateral law in place of the recorded one");
        command.add_option("--contact-model", o.contact_model,
                           "Contact model in place of the recorded one: what would have been felt? A table compares "
                           "the forces of the two");
        command.add_option(
            "--true-force", o.true_force,
            "With --contact-model: CSV table of the same session, by knuckle simulate --csv, to tell how "
            "far each model is off the true force");
        command.add_note(
            "A change is compared open loop: hand and machine move as recorded, whatever the changed loops command. A "
            "changed gain shows other commands and forces, not the motion that it would lead to; for that run knuckle "
            "simulate.");
      },
      run);
}

}  // namespace knuckle::replay
