#include <fmt/format.h>

#include <array>
#include <iostream>
#include <memory>
#include <utility>
#include <vector>

#include "app/battery/cell.h"
#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "app/programs/programs.h"
#include "app/recordings/own_table.h"
#include "app/report/plots.h"
#include "app/report/report.h"
#include "app/report/result_text.h"
#include "app/session/scenario.h"
#include "core/error.h"
#include "machine/load.h"
#include "recording/file_names.h"
#include "transport/socket_address.h"

namespace knuckle::programs {
namespace {

constexpr double kLongestSession_s = 3600;
/// What a cell says itself.
constexpr std::array kInputs{"--scenario",   "--machine",  "--operator",     "--person",       "--family",
                             "--map",        "--seed",     "--delay-ms",     "--jitter-ms",    "--loss",
                             "--truth",      "--realtime", "--bursts-per-s", "--device",       "--machine-seed",
                             "--impairment", "--listen",   "--connect",      "--contact-model"};

void add_options(const cli::OptionList& c, session::SimulateOptions& o) {
  c.add_option("--scenario", o.scenario, "Scenario name or .toml file").show_default();
  c.add_option("--from-cell", o.from_cell,
               "Run session N of a battery again: FILE:N, FILE written by knuckle-studies sweep --json");
  c.add_option("--machine", o.machine, "Machine name or .toml file (default: solar015)");
  c.add_option("--device", o.device,
               "Haptic device name or .toml file (default: knuckle1, or knuckle1_MACHINE where there is one)");
  c.add_option(
      "--operator", o.operator_name,
      "Operator's limb by name, or path:FILE (.csv with --map, or .mcap; of several parts path:FILE,FILE) to play a "
      "recorded motion");
  c.add_option("--person", o.person, "How much of a person the operator is: exact, steady or rough (default: exact)");
  c.add_option("--map", o.map, "Mapping file (.toml) that says how to read the recorded motion");
  c.add_option("--control", o.control, "Bilateral law: echo, cues or direct (default: as the device's file says)");
  c.add_option("--contact-model", o.contact_model,
               "Contact model by name, in place of the machine file's (docs/theory.md)");
  c.add_option("--duration", o.duration_s, "Stop after so many seconds");
  c.add_option("--seed", o.seed, "Random seed of the plant's true parameters, the link and the operator")
      .show_default()
      .check(cli::seed_error);
  c.add_option("--machine-seed", o.machine_seed,
               "Random seed of the plant's true parameters alone: one machine, on the day that --seed draws")
      .check(cli::seed_error);
  c.add_option("--delay-ms", o.delay_ms, "Link delay, one way");
  c.add_option("--jitter-ms", o.jitter_ms, "Link jitter: half-width of the delay's variation, at most the delay");
  c.add_option("--loss", o.loss, "Share of datagrams lost, 0 to 1");
  c.add_option("--bursts-per-s", o.bursts_per_s, "Mean rate of link outages of 50 ms, 0 to 10");
  c.add_option("--impairment", o.impairment,
               "What the link does, name or .toml file, such as lte (docs/network.md); instead of the options above");
  c.add_option("--assist-force-limit", o.assist_force_limit_N, "Force-limited approach: tip force in N, 0 = off");
  c.add_flag("--assist-stop-on-object", o.assist_stop_on_object,
             "Stop when the bucket meets something stiff while digging");
  c.add_flag("-v,--verbose", o.verbose, "List in the summary also what was met");
  c.add_flag("--judge", o.judge,
             "Let the scenario's requirements decide with any machine and option, not only as shipped");
  c.add_flag("--realtime", o.realtime, "Run the loops in real-time threads over UDP loopback");
  c.add_option("--listen", o.listen, "With --realtime: address and port of the link's end at the machine");
  c.add_option("--connect", o.connect,
               "With --realtime: where the operator's end sends to, such as a `knuckle relay` before --listen");
  c.add_option("--family", o.family,
               "Machines and devices that the seed samples from: smooth (default), serviced or worn");
  c.add_option("--truth", o.truth,
               "The simulated machine's true parameters (.toml), instead of sampling them from the seed");
  c.add_option("--candump", o.candump, "Write every CAN frame in candump log format (- = standard output)");
  c.add_option("--log", o.log, "Record all that the loops read, know and do (a new .mcap; docs/recordings.md)");
  c.add_option("--flights", o.flights, "Folder for flight records: the last half minute of every fault and stop");
  c.add_option("--csv", o.csv, "Write a CSV table, a row each step of the machine's loop");
  c.add_option("--report", o.report, "Write a self-contained HTML report");
  c.add_option("--json", o.json, "Write the result as JSON (described in docs/scenarios.md)");
}

void check_places(const session::SimulateOptions& o) {
  cli::Places places;
  if (o.scenario_text.empty()) places.configuration("--scenario", o.scenario);
  places.configuration("--machine", o.machine);
  places.configuration("--device", o.device);
  places.configuration("--impairment", o.impairment);
  places.input("--map", o.map);
  places.input("--truth", o.truth);
  for (const std::string& file : o.operator_paths()) places.input("--operator", file);
  places.input("--from-cell", o.from_cell.substr(0, o.from_cell.rfind(':')));
  places.output("--candump", o.candump);
  places.output("--log", o.log);
  if (!o.log.empty()) places.output("--log", o.log + recording::kUnfinished);
  places.output("--csv", o.csv);
  places.output("--report", o.report);
  places.output("--json", o.json);
}

/// One description of the link, and addresses where there are some.
void check_link(const session::SimulateOptions& o) {
  if (!o.impairment.empty() && (o.delay_ms || o.jitter_ms || o.loss || o.bursts_per_s))
    cli::refuse_option("--impairment", o.impairment,
                       "does not go with --delay-ms, --jitter-ms, --loss or --bursts-per-s: the file says all");
  if (o.listen.empty() != o.connect.empty())
    cli::refuse_option(o.listen.empty() ? "--connect" : "--listen", o.listen + o.connect,
                       "give --listen and --connect, or neither");
  if (o.listen.empty()) return;
  if (!o.realtime) cli::refuse_option("--listen", o.listen, "only goes with --realtime");
  (void)parse_address(o.listen, "--listen");
  (void)parse_host_and_port(o.connect, "--connect");
}

void check(const session::SimulateOptions& o) {
  if (o.scenario.empty()) cli::refuse_option("--scenario", "\"\"", "must name a scenario");
  cli::check_range("--duration", o.duration_s, 0.1, kLongestSession_s, " s");
  cli::check_range("--delay-ms", o.delay_ms, 0, session::kLongestDelay_ms, " ms");
  cli::check_range("--jitter-ms", o.jitter_ms, 0, session::kLongestDelay_ms, " ms");
  cli::check_range("--loss", o.loss, 0, 1, "");
  cli::check_range("--bursts-per-s", o.bursts_per_s, 0, 10, " per s");
  if (!o.log.empty() && !recordings::is_recording(o.log)) cli::refuse_option("--log", o.log, "must end in .mcap");
  check_link(o);
  if (o.assist_force_limit_N && *o.assist_force_limit_N != 0)
    cli::check_range("--assist-force-limit", o.assist_force_limit_N, session::kLeastAssist_N, session::kMostAssist_N,
                     " N, or 0: off");
  if (!o.control.empty() && !control_law_named(o.control))
    cli::refuse_option("--control", o.control, kControlLawChoice);
  if (!o.contact_model.empty() && !contact_model_named(o.contact_model))
    cli::refuse_option("--contact-model", o.contact_model, kContactModelChoice);
  const std::vector<std::string> path = o.operator_paths();
  for (const std::string& file : path)
    if (file.empty()) cli::refuse_option("--operator", "", "must name a file after 'path:' and after each comma");
  for (const std::string& file : path) cli::check_readable("--operator", file);
  if (!path.empty() && o.map.empty() && !recordings::is_recording(path.front()))
    cli::refuse_option("--operator", o.operator_name, "needs --map FILE.toml to say how to read it");
  if (path.empty() && !o.map.empty()) cli::refuse_option("--map", o.map, "only goes with --operator path:FILE.csv");
  if (!o.map.empty()) cli::check_readable("--map", o.map);
  if (!o.truth.empty()) cli::check_readable("--truth", o.truth);
  if (!o.flights.empty()) cli::check_folder("--flights", o.flights);
  if (o.machine_seed && !o.truth.empty())
    cli::refuse_option("--machine-seed", std::to_string(*o.machine_seed), "does not go with --truth");
  check_places(o);
}

/// Replaces all inputs by those of a battery's session. @throws InputError
void take_cell(session::SimulateOptions& o) {
  session::SimulateOptions cell = battery::cell_of_result(o.from_cell);
  const bool as_it_was = o.control.empty() && !o.duration_s && !o.assist_force_limit_N && !o.assist_stop_on_object;
  if (!as_it_was) cell.cell_digest.clear();
  if (!o.control.empty()) cell.control = o.control;
  cell.duration_s = o.duration_s;
  cell.assist_force_limit_N = o.assist_force_limit_N;
  cell.assist_stop_on_object = o.assist_stop_on_object;
  cell.candump = o.candump;
  cell.log = o.log;
  cell.flights = o.flights;
  cell.csv = o.csv;
  cell.report = o.report;
  cell.json = o.json;
  cell.verbose = o.verbose;
  o = std::move(cell);
}

/// Every requested output, opened before the session so that a bad place is known at once.
struct Outputs {
  explicit Outputs(const session::SimulateOptions& o)
      : candump("--candump", o.candump), csv("--csv", o.csv), report("--report", o.report), json("--json", o.json) {
    if (report) report::check_gnuplot();
  }
  cli::OptionalOutput candump, csv, report, json;
};

/// What an interrupted session leaves behind.
std::string kept(const recording::RecorderStatus& log) {
  std::string text;
  if (!log.problem.empty())
    text = "the recording has ended: " + log.problem + "; ";
  else if (!log.file.empty())
    text = "what was recorded until then is in " + log.file + "; ";
  for (const std::string& file : log.flights) text += "flight record: " + file + "; ";
  for (const std::string& notice : log.notices) text += notice + "; ";
  return text.empty() ? "nothing was written" : text + "no other file was written";
}

bool uses_standard_output(const session::SimulateOptions& o) {
  return cli::is_standard_output(o.candump) || cli::is_standard_output(o.csv) || cli::is_standard_output(o.report) ||
         cli::is_standard_output(o.json);
}

}  // namespace

cli::Command simulate_entry(std::function<int(const session::SimulateOptions&, const std::string& command_line)> run) {
  return {"simulate", "Run a headless teleoperation session on virtual time",
          [run = std::move(run)](const cli::OptionList& command) {
            const auto options = std::make_shared<session::SimulateOptions>();
            add_options(command, *options);
            return [options, command, run] {
              const bool from_cell = !options->from_cell.empty();
              for (const char* input : kInputs) {
                if (from_cell && command.given(input)) cli::refuse_option(input, "", "does not go with --from-cell");
              }
              if (from_cell) take_cell(*options);
              check(*options);
              return run(*options, "knuckle simulate" + command.as_given());
            };
          }};
}

int simulate_command(
    const session::SimulateOptions& options, const std::string& command_line,
    const std::function<session::SessionResult(const session::SimulateOptions&, const session::SessionHooks&)>& run) {
  const cli::InterruptGuard interrupt;
  Outputs outputs(options);
  session::SessionResult session;
  recording::RecorderStatus log;
  try {
    cli::ProgressBar bar(options.scenario);
    session::SessionHooks hooks;
    hooks.progress = [&](double done_fraction) {
      interrupt.check();
      bar.show(done_fraction);
    };
    hooks.recorded = [&log](const recording::RecorderStatus& status) { log = status; };
    if (outputs.candump) hooks.candump = &outputs.candump->stream();
    session = run(options, hooks);
  } catch (const cli::Interrupted&) {
    throw cli::Interrupted(kept(log));
  }
  if (!options.cell_digest.empty() && session.digest.whole != options.cell_digest)
    session.notes.push_back(fmt::format(
        "{}: this is not the session that the battery ran: another build, or another machine, device or scenario file",
        options.from_cell));
  const session::Judged judged = session::judge(session);
  if (outputs.csv) report::write_csv(session.record, outputs.csv->stream());
  if (outputs.json) outputs.json->stream() << report::result_json(judged).dump(2) << '\n';
  for (auto* file : {&outputs.candump, &outputs.csv, &outputs.json}) file->commit();
  // Last: should the plots fail, the numbers are safe.
  outputs.report.write([&](std::ostream& to) { report::write_report(judged, {command_line, cli::now_utc()}, to); });
  // Standard output belongs to whatever was sent there.
  (uses_standard_output(options) ? std::cerr : std::cout)
      << report::summary_text(judged, options.report, options.verbose);
  if (!session.log.problem.empty()) throw InputError("--log " + options.log + ": " + session.log.problem);
  return judged.passed.value_or(true) ? 0 : 1;
}

}  // namespace knuckle::programs
