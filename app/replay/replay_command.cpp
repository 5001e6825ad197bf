#include "app/replay/replay_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>
#include <utility>

#include "app/cli/interrupt.h"
#include "app/recordings/csv_cells.h"
#include "core/error.h"
#include "core/quantile.h"
#include "core/time.h"
#include "estimation/force_estimator.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "recording/recording.h"

namespace knuckle::replay {

namespace {

constexpr double kTimeUnit_s = 1e-4;  // steps are further apart, and a table's digits tell as much
constexpr double kSameForce = 1e-6;   // of a force, or N: a table has ten digits
constexpr const char* kTimeColumn = "time_s";

std::int64_t key_of(double time_s) noexcept {
  return std::llround(time_s / kTimeUnit_s);
}

/// The model neither refuses the pose, nor does the estimator repeat an older answer.
bool answers(const slave::SlaveState& state) noexcept {
  using namespace estimation;
  constexpr unsigned kNoAnswer =
      kStraightArm | kBucketInLine | kNearToggle | kDirectionAlongLink | kOffTheBucket | kNoDirection | kBadInput;
  return (state.confidence_reasons & kNoAnswer) == 0 && state.tip_force_N.allFinite();
}

std::string median_and_p95(const std::vector<double>& sizes_N) {
  if (sizes_N.empty()) return fmt::format("  {:>10} {:>10}", "-", "-");
  return fmt::format("  {:>10.1f} {:>10.1f}", median(sizes_N), quantile(sizes_N, 0.95));
}

}  // namespace

ForceComparison::ForceComparison(ContactModel recorded, ContactModel replayed, const std::string& session_table)
    : table_(session_table), models_{Model{.model = recorded}, Model{.model = replayed}} {
  if (!table_.empty()) read(table_);
}

void ForceComparison::read(const std::string& session_table) {
  const std::vector<std::string> names{kTimeColumn, "truth_tip_force_x_N", "truth_tip_force_z_N", "tip_force_x_N",
                                       "tip_force_z_N"};
  recordings::CsvFile file = recordings::read_cells(session_table, names);
  std::vector<std::size_t> columns;
  for (const std::string& name : names) columns.push_back(recordings::column_index(file, name));
  recordings::find_decimal_mark(file, columns);
  for (std::size_t i = 1; i < file.rows.size(); ++i) {
    const recordings::Cells& cells = file.rows[i];
    const auto number = [&](std::size_t column) {
      return columns[column] < cells.size() ? file.number(cells[columns[column]]) : std::nan("");
    };
    const double time_s = number(0);
    const Row row{{number(1), number(2)}, {number(3), number(4)}};
    if (std::isfinite(time_s) && row.true_N.allFinite()) rows_[key_of(time_s)] = row;
  }
}

void ForceComparison::add(const slave::SlaveState& recorded, const slave::SlaveState& replayed) {
  if (!recorded.measured || !replayed.measured) return;
  ++steps_;
  const auto row = rows_.find(key_of(to_seconds(recorded.at)));
  const bool known = row != rows_.end();
  if (known &&
      (row->second.estimated_N - recorded.tip_force_N).norm() > kSameForce * std::max(1.0, recorded.tip_force_N.norm()))
    throw InputError(
        fmt::format("{}: is of another session than the recording: at {:.4f} s its tip_force_N is {:.6g}, {:.6g}, "
                    "recorded {:.6g}, {:.6g}",
                    table_, to_seconds(recorded.at), row->second.estimated_N.x(), row->second.estimated_N.y(),
                    recorded.tip_force_N.x(), recorded.tip_force_N.y()));
  const std::array states{&recorded, &replayed};
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (!answers(*states[i])) continue;
    ++models_[i].answered;
    if (!known) continue;
    const double off_N = (states[i]->tip_force_N - row->second.true_N).norm();
    models_[i].off_N.push_back(off_N);
    if (row->second.true_N.norm() > kTouching_N) models_[i].off_touching_N.push_back(off_N);
  }
  if (answers(recorded) && answers(replayed)) apart_N_.push_back((replayed.tip_force_N - recorded.tip_force_N).norm());
}

std::string ForceComparison::text() const {
  if (steps_ == 0) return {};
  const bool with_truth = !table_.empty();
  if (with_truth && models_[0].off_N.empty() && models_[1].off_N.empty())
    throw InputError(table_ + ": has no row of a step of this recording in which a model answered");
  std::string text = fmt::format("force by contact model, in {} steps:\n  {:<32} {:>9}  {:>21}", steps_, "", "",
                                 "beside the other, N");
  if (with_truth) text += fmt::format("  {:>21}  {:>21}", "off the true force, N", "off it, touching, N");
  text += fmt::format("\n  {:<32} {:>9}", "contact model", "answered");
  for (int i = 0; i < (with_truth ? 3 : 1); ++i) text += fmt::format("  {:>10} {:>10}", "median", "p95");
  for (const Model& model : models_) {
    const char* const which = &model == &models_[0] ? "recorded" : "replayed";
    text += fmt::format("\n  {:<32} {:>7.1f} %", fmt::format("{}, {}", name(model.model), which),
                        100.0 * static_cast<double>(model.answered) / static_cast<double>(steps_)) +
            median_and_p95(apart_N_);
    if (with_truth) text += median_and_p95(model.off_N) + median_and_p95(model.off_touching_N);
  }
  return text + '\n';
}

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
