#include "app/bringup/commission_command.h"

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/bringup/can_interfaces.h"
#include "app/bringup/commission_result.h"
#include "app/bringup/commission_wizard.h"
#include "app/bringup/dialogue_log.h"
#include "app/bringup/planned_faults.h"
#include "app/cli/background_writer.h"
#include "app/cli/command.h"
#include "app/cli/digest.h"
#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "core/error.h"
#include "core/text.h"
#include "machine/file_text.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "sim/machine_on_bus.h"
#include "slave/bus_listen.h"

namespace knuckle::bringup {

namespace {

using OrderedJson = nlohmann::ordered_json;
constexpr const char* kSchema = "knuckle-commission-progress/3";
constexpr std::size_t kLargest_MB = 1;
constexpr int kDeepest = 8;  // of what is nested in it; written are 5

OrderedJson json_of(bool value) {
  return value;
}
OrderedJson json_of(const std::optional<double>& value) {
  return value ? OrderedJson(*value) : OrderedJson(nullptr);
}
void take(const OrderedJson& json, bool& value) {
  value = json.get<bool>();
}
void take(const OrderedJson& json, std::optional<double>& value) {
  if (!json.is_null()) value = json.get<double>();
}

OrderedJson json_of(const WizardProgress& progress) {
  OrderedJson axes = OrderedJson::array(), findings = OrderedJson::array(), serials = OrderedJson::array();
  for (const auto& [id, serial] : progress.serials) serials.push_back({{"node", id}, {"serial", serial}});
  for (const AxisResult& axis : progress.axes) {
    OrderedJson& one = axes.emplace_back();
    AxisResult::fields(axis, [&one](const char* key, const auto& value) { one[key] = json_of(value); });
  }
  for (const Finding& one : progress.findings)
    findings.push_back({{"level", static_cast<int>(one.level)}, {"about", one.about}, {"text", one.text}});
  return {{"completed", progress.completed}, {"serials", serials}, {"axes", axes}, {"findings", findings}};
}

struct Unusable {};

/// @throws Unusable where it is no whole number within these.
template <typename Number>
Number whole_number(const OrderedJson& value, std::uint64_t least, std::uint64_t most) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() < least || value.get<std::uint64_t>() > most)
    throw Unusable{};
  return static_cast<Number>(value.get<std::uint64_t>());
}
/// @throws Unusable where a terminal would not show it as it is.
std::string printable_text(const OrderedJson& value) {
  std::string text = value.get<std::string>();
  if (printable(text) != text) throw Unusable{};
  return text;
}

/// @throws nlohmann::json::exception where something is missing or of another kind. @throws Unusable
WizardProgress progress_of(const OrderedJson& json) {
  WizardProgress progress;
  progress.completed = whole_number<int>(json.at("completed"), 0, kDeadBands);
  for (const OrderedJson& one : json.at("serials"))
    progress.serials[whole_number<std::uint8_t>(one.at("node"), 1, 127)] =
        whole_number<std::uint32_t>(one.at("serial"), 0, std::numeric_limits<std::uint32_t>::max());
  for (std::size_t j = 0; j < progress.axes.size(); ++j) {
    const OrderedJson& axis = json.at("axes").at(j);
    AxisResult::fields(progress.axes[j], [&axis](const char* key, auto& value) { take(axis.at(key), value); });
  }
  for (const OrderedJson& one : json.at("findings"))
    progress.findings.push_back(
        {static_cast<Finding::Level>(whole_number<int>(one.at("level"), 0, static_cast<int>(Finding::Level::kFault))),
         printable_text(one.at("about")), printable_text(one.at("text"))});
  return progress;
}

/// @throws nlohmann::json::exception, Unusable: nothing that is nested deeper is taken apart.
OrderedJson parsed(const std::string& text) {
  return OrderedJson::parse(text, [](int depth, OrderedJson::parse_event_t, const OrderedJson&) {
    if (depth > kDeepest) throw Unusable{};
    return true;
  });
}

/// Of all that is said; nobody's secret, it only finds what was changed by hand.
std::string digest_of(OrderedJson json) {
  json.erase("sha256");
  return cli::sha256(json.dump());
}

}  // namespace

std::string progress_file(const std::string& out) {
  return out + ".progress";
}

void write_progress(const std::string& file, const WizardProgress& progress, const ProgressOf& of) {
  OrderedJson json{{"schema", kSchema},
                   {"program", cli::program_version()},
                   {"bus", of.bus},
                   {"machine_sha256", of.machine_sha256},
                   {"progress", json_of(progress)}};
  json["sha256"] = digest_of(json);
  cli::OutputFile out("--out", file);
  out.stream() << json.dump(1) << '\n';
  out.commit();
}

WizardProgress read_progress(const std::string& file, const ProgressOf& of) {
  const auto refuse = [&file](const std::string& why) {
    cli::refuse_option("--resume", file, why + ": begin anew, without --resume");
  };
  if (std::error_code none; !std::filesystem::exists(file, none)) refuse("no earlier run to go on with is kept there");
  const std::string text = whole_file(file, kLargest_MB);
  try {
    const OrderedJson json = parsed(text);
    if (json.at("schema") != kSchema) refuse("is not the progress of a commissioning of this version");
    if (json.at("sha256") != digest_of(json)) refuse("was changed since it was written");
    if (json.at("machine_sha256") != of.machine_sha256)
      refuse("is of another machine file, or of an older version of it");
    if (json.at("bus") != of.bus)
      refuse("is of the bus " + shortened(json.at("bus").get<std::string>()) + ", not " + of.bus);
    return progress_of(json.at("progress"));
  } catch (const nlohmann::json::exception&) {
    refuse("is not the progress of a commissioning");
  } catch (const Unusable&) {
    refuse("is not the progress of a commissioning");
  }
  return {};
}

namespace {

struct CommissionCommandOptions {
  std::vector<std::string> can;
  std::string machine, out, record = ".";
  bool simulate = false, resume = false;
  std::uint64_t seed = 1;
  std::vector<std::string> faults;
  IdentifyMotions motions;
  recordings::LogOptions log;
};

void add_options(const cli::OptionList& c, CommissionCommandOptions& o) {
  c.add_option("--can", o.can, "CAN interface of the machine bus (can0); of two NAME=INTERFACE for each")
      .one_value_each();
  c.add_flag("--simulate", o.simulate, "Commission the simulated machine instead, on virtual time");
  c.add_option("--seed", o.seed, "Seed of the recorded motions and, with --simulate, of the machine's true parameters")
      .show_default()
      .check(cli::seed_error);
  c.add_option("--fault", o.faults,
               "With --simulate: inject a fault: KIND[:NODE]@S[+D], from S seconds on for D seconds, such as "
               "guard_dead:boom_valve@0 (docs/programs.md#knuckle-node)")
      .one_value_each();
  c.add_option("--machine", o.machine, "Machine name or .toml file").required();
  c.add_option("--out", o.out, "Write the machine file with the measured values (.toml)").required();
  c.add_flag("--resume", o.resume, "Go on after the last completed step of a run that has ended, kept beside --out");
  c.add_option("--record", o.record, "Folder for the recordings that knuckle identify reads").show_default();
  recordings::add_log_options(c, o.log, "Record nothing");
  c.add_option("--slow", o.motions.slow_s, "Seconds of slow sweeps to record, 20 to 1200").show_default();
  c.add_option("--fast", o.motions.fast_s, "Seconds of fast motion to record, 20 to 1200").show_default();
}

/// The first of the recordings that a folder contains; empty: none.
std::string recorded_in(const std::string& folder) {
  std::error_code error;
  for (const char* name : kMotionNames)
    if (std::filesystem::exists(recording_file(folder, name), error)) return name;
  return "";
}

void check(const CommissionCommandOptions& o) {
  if (o.simulate && !o.can.empty()) cli::refuse_option("--can", can_text(o.can), "give --can or --simulate, not both");
  if (!o.simulate && o.can.empty()) cli::refuse_option("commission", "", "needs --can, or --simulate");
  if (!o.simulate && !o.faults.empty()) cli::refuse_option("--fault", o.faults[0], "only goes with --simulate");
  recordings::check_log(o.log);
  cli::check_range("--slow", o.motions.slow_s, 20, 1200, " s");
  cli::check_range("--fast", o.motions.fast_s, 20, 1200, " s");
  if (cli::is_standard_output(o.out))
    cli::refuse_option("--out", o.out, "must be a file: standard output is used for the dialogue");
  cli::check_folder("--record", o.record);
  if (const std::string name = recorded_in(o.record); !name.empty())
    cli::refuse_option("--record", o.record, "already contains " + name + ".csv; choose another folder");
  cli::Places places;
  places.configuration("--machine", o.machine);
  places.configuration_output("--out", o.out);
}

std::vector<PlannedFault> faults_of(const CommissionCommandOptions& o, const BusDescription& bus) {
  std::vector<PlannedFault> plan;
  for (const std::string& asked : o.faults) {
    plan.push_back(parse_fault(asked, bus));
    if (!plan.back().at_s) cli::refuse_option("--fault", asked, "usr1 is for knuckle node: needs seconds here");
  }
  return plan;
}

/// @param read the machine file as read, not calibrated: calibrating the file must not change the simulated machine.
BusAccess access_of(const CommissionCommandOptions& o, const MachineDescription& read) {
  if (!o.simulate) return machine_access(o.can, read.bus);
  const auto machine = std::make_shared<sim::MachineOnBus>(sim::sample_truth(read, o.seed), sim::WorldDescription{},
                                                           middle_of_range(read), o.seed);
  machine->each_tick = [faults = NodeFaults(faults_of(o, read.bus), read.bus)](sim::MachineOnBus& far) mutable {
    faults.step(far.now(), 0, far, [](const FaultEvent&) {});
  };
  return sim::access_to(machine);
}

std::string command_of(const CommissionCommandOptions& o, const std::string& file) {
  std::string text = "knuckle commission --machine " + file + (o.simulate ? " --simulate" : "") + can_arguments(o.can);
  for (const std::string& fault : o.faults) text += " --fault " + fault;
  return text;
}

/// What of this run is done, in its file.
class Progress {
 public:
  /// @throws InputError as read_progress() does.
  Progress(std::string file, ProgressOf of, bool resume) : file_(std::move(file)), of_(std::move(of)) {
    if (resume) resume_.from = read_progress(file_, of_);
    resumed_ = resume;
    resume_.keep = [this](const WizardProgress& progress) {
      if (!resumed_ && completed_ == 0) (void)cli::keep_older(file_);  // of a run before this one
      completed_ = progress.completed;
      write_progress(file_, progress, of_);
    };
    completed_ = resume_.from.completed;
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  [[nodiscard]] const Resume& resume() const noexcept { return resume_; }
  [[nodiscard]] std::string note() const {
    if (resumed_)
      return "Goes on after step " + std::to_string(completed_) + " of the run before; steps 1 to 4 are made again.";
    return std::filesystem::exists(file_)
               ? file_ + ": an earlier run has ended before its end; --resume may go on with it, this run begins anew"
               : "";
  }
  /// @param recordings the folder that has some already; empty: there are none.
  [[nodiscard]] std::string hint(const std::string& recordings) const {
    if (completed_ < kStrokes) return "";
    return "; steps up to " + std::to_string(completed_) + " are kept in " + file_ +
           ": the same command with --resume goes on after them" +
           (recordings.empty() ? "" : ", with another --record folder, as there are recordings in " + recordings);
  }
  /// The result is written: nothing is left to go on with.
  void done() const {
    std::error_code error;
    std::filesystem::remove(file_, error);
  }

 private:
  std::string file_;
  ProgressOf of_;
  Resume resume_;
  bool resumed_ = false;
  int completed_ = 0;
};

std::string next_command(const std::vector<std::string>& r, const std::string& machine) {
  return "next: knuckle identify " + r[0] + ' ' + r[1] + " --hold-out " + r[2] + " --hold-out " + r[3] + " --machine " +
         machine + " --out calibrated.toml --report identify.html\n";
}

int run_commission(CommissionCommandOptions options) {
  check(options);
  const cli::InterruptGuard interrupt;
  const std::string file = find_config("machine", options.machine), text = whole_file(file, kLargestToml_MB);
  const MachineDescription read = load_machine(file), machine = calibrated(read);
  check_layout(text, machine);
  cli::OutputFile out("--out", options.out);
  BusAccess bus = access_of(options, read);
  slave::refuse_other_controller(machine.bus, bus);
  options.motions.seed = options.seed;
  const std::string kept = progress_file(options.out), digest = cli::sha256(text);
  Progress progress(kept, {bus.name(), digest}, options.resume);
  DialogueLog log(options.log, dialogue_head(command_of(options, file), text, options.simulate, bus.now()), machine,
                  "commission");
  BusAccess access = log.tapped(bus);
  LineInput input(STDIN_FILENO);
  cli::BackgroundWriter dialogue(STDOUT_FILENO);  // nobody who does not read it holds up the machine's loop, or a stop
  std::ostream& told = dialogue.stream();
  for (const std::string& line : log.notes()) told << line << '\n';
  const Partner person = log.noted(terminal(
      told, [&] { return input.poll(); }, isatty(STDIN_FILENO) == 1));
  const auto record = [&](const MachineDescription& found, const std::function<bool()>& stopped) {
    return record_motions(found, access, options.motions, options.record, stopped);
  };
  const auto hint = [&] { return progress.hint(recorded_in(options.record).empty() ? "" : options.record); };
  if (const std::string note = progress.note(); !note.empty()) told << note << '\n';
  told << std::flush;
  check_told(dialogue, kToldPatience);
  const auto go_on = [&] {
    neutral_where_interrupted(interrupt);
    check_told(dialogue);
  };
  try {
    WizardResult result;
    std::string older;
    log.run(told, [&] {
      result = run_wizard(machine, access, person, record, go_on, progress.resume());
      out.stream() << commissioned_text(text, machine, result, {access.name(), cli::now_utc(), digest});
      older = out.commit_keeping_older();
      progress.done();
    });
    told << "\nwritten: " << options.out << (older.empty() ? "" : "; the previous file was kept as " + older) << '\n';
    if (result.recordings.size() == kMotionNames.size()) told << next_command(result.recordings, options.out);
    return 0;
  } catch (const CommissionEnded& ended) {
    dialogue.finish();
    const bool lost = dynamic_cast<const ProgressLost*>(&ended) != nullptr;
    cli::BackgroundWriter(STDERR_FILENO).stream()
        << "knuckle: commissioning ended, machine neutral, nothing written to " << options.out << ": "
        << printable(ended.what()) << (lost ? "" : hint()) << '\n';
    return 1;
  } catch (const cli::Interrupted&) {
    throw cli::Interrupted("nothing was written to " + options.out + hint());
  }
}

}  // namespace

cli::Command commission_entry() {
  return {"commission", "First motions of a machine, step by step: signs, stroke ends, zero, dead bands, recordings",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<CommissionCommandOptions>();
            add_options(command, *options);
            command.add_note("Answers are read from standard input: one word or number per line.");
            return [options] { return run_commission(*options); };
          }};
}

}  // namespace knuckle::bringup
